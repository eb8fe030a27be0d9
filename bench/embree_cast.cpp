// Embree on the rays of `visibility --dump` (s3d-render/examples/visibility.rs): how fast, and whether it sees the same.
//
//   g++ -O3 -march=native -ffp-contract=off -o embree_cast embree_cast.cpp -lembree3      (Debian: libembree-dev 3.x)
//   embree_cast time DUMP [ROUNDS=3] [ISA]   Mray/s of user time, one thread: the median of the rounds; ISA (sse4.2,
//                                            avx2, …) is the most that Embree may use, else all that the processor has
//   embree_cast compare DUMP                 robust mode, single rays: compares each pixel with the dump, writes DUMP/differences.csv
//
// Embree takes f32: the origin of a dump is representable in it, so both start at the very same point; vertices are f32
// anyway; the directions are computed in f64 as s3d does, then each component is rounded once to f32, the nearest that
// Embree can be given. Timing: directions of views are made in the loop in f32 (three multiplications and additions, as
// a renderer would), those of the panorama beforehand, uncounted. What is counted writes face and distance of each pixel.
#include <embree3/rtcore.h>
#include <pmmintrin.h>
#include <sys/resource.h>
#include <xmmintrin.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

struct Direction { float x, y, z; };

// Pixel (i, j) looks along corner + x_step (i + 1/2) + y_step (j + 1/2).
struct View { double corner[3], x_step[3], y_step[3]; };

// The same in f32.
struct ViewInF32 { float corner[3], x_step[3], y_step[3]; };

struct Dump {
    std::string folder;
    unsigned vertices, faces, views, width, height, pano_width, pano_height;
    float origin[3];
    std::vector<float> positions;
    std::vector<unsigned> indices;
    std::vector<View> cameras;
    std::vector<double> columns, rows;
};

template <class T> std::vector<T> read(const std::string& path, size_t count) {
    std::vector<T> values(count);
    FILE* file = fopen(path.c_str(), "rb");
    if (!file || fread(values.data(), sizeof(T), count, file) != count) {
        fprintf(stderr, "%s: cannot read %zu values\n", path.c_str(), count);
        exit(1);
    }
    fclose(file);
    return values;
}

Dump read_dump(const std::string& folder) {
    Dump d;
    d.folder = folder;
    FILE* file = fopen((folder + "/dump.txt").c_str(), "r");
    if (!file || fscanf(file, "%u %u %u %u %u %u %u %f %f %f", &d.vertices, &d.faces, &d.views, &d.width, &d.height,
                        &d.pano_width, &d.pano_height, d.origin, d.origin + 1, d.origin + 2) != 10) {
        fprintf(stderr, "%s: no dump\n", folder.c_str());
        exit(1);
    }
    fclose(file);
    d.positions = read<float>(folder + "/positions.f32", 3 * (size_t)d.vertices);
    d.indices = read<unsigned>(folder + "/faces.u32", 3 * (size_t)d.faces);
    d.cameras = read<View>(folder + "/views.f64", d.views);
    d.columns = read<double>(folder + "/columns.f64", 2 * d.pano_width);
    d.rows = read<double>(folder + "/rows.f64", 2 * d.pano_height);
    return d;
}

Direction direction(const View& v, unsigned i, unsigned j) {
    float d[3];
    for (int k = 0; k < 3; k++) d[k] = (float)(v.corner[k] + v.x_step[k] * (i + 0.5) + v.y_step[k] * (j + 0.5));
    return {d[0], d[1], d[2]};
}

Direction direction(const Dump& d, unsigned i, unsigned j) {
    const double *c = &d.columns[2 * i], *r = &d.rows[2 * j];
    return {(float)(r[0] * c[0]), (float)(r[0] * c[1]), (float)r[1]};
}

RTCScene build(RTCDevice device, const Dump& d, bool robust) {
    RTCScene scene = rtcNewScene(device);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);
    if (robust) rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    RTCGeometry mesh = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetGeometryBuildQuality(mesh, RTC_BUILD_QUALITY_HIGH);
    void* to = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 12, d.vertices);
    memcpy(to, d.positions.data(), 12 * (size_t)d.vertices);
    to = rtcSetNewGeometryBuffer(mesh, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, d.faces);
    memcpy(to, d.indices.data(), 12 * (size_t)d.faces);
    rtcCommitGeometry(mesh);
    rtcAttachGeometry(scene, mesh);
    rtcReleaseGeometry(mesh);
    rtcCommitScene(scene);
    return scene;
}

struct Image {
    unsigned width, height;
    std::vector<unsigned> face;
    std::vector<float> depth;
    Image(unsigned w, unsigned h) : width(w), height(h), face((size_t)w * h), depth((size_t)w * h) {}
};

// Packets of 4 x N/4 pixels, tile by tile of 32 x 32. `along(i, j)` is the direction of a pixel.
template <int N, class Packet, class Along>
void cast_packets(RTCScene scene, const float* origin, Image& image, Along along,
                  void (*intersect)(const int*, RTCScene, RTCIntersectContext*, Packet*)) {
    const unsigned TILE = 32, ROWS = N / 4;
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    for (unsigned top = 0; top < image.height; top += TILE)
    for (unsigned left = 0; left < image.width; left += TILE)
    for (unsigned y = top; y < std::min(top + TILE, image.height); y += ROWS)
    for (unsigned x = left; x < std::min(left + TILE, image.width); x += 4) {
        Packet p;
        alignas(64) int valid[N];
        for (int k = 0; k < N; k++) {
            unsigned i = x + k % 4, j = y + k / 4;
            valid[k] = i < image.width && j < image.height ? -1 : 0;
            Direction d = along(std::min(i, image.width - 1), std::min(j, image.height - 1));
            p.ray.org_x[k] = origin[0], p.ray.org_y[k] = origin[1], p.ray.org_z[k] = origin[2];
            p.ray.dir_x[k] = d.x, p.ray.dir_y[k] = d.y, p.ray.dir_z[k] = d.z;
            p.ray.tnear[k] = 0, p.ray.tfar[k] = INFINITY, p.ray.time[k] = 0;
            p.ray.mask[k] = -1, p.ray.id[k] = 0, p.ray.flags[k] = 0;
            p.hit.geomID[k] = p.hit.primID[k] = p.hit.instID[0][k] = RTC_INVALID_GEOMETRY_ID;
        }
        intersect(valid, scene, &context, &p);
        for (int k = 0; k < N; k++) {
            if (!valid[k]) continue;
            size_t at = (size_t)(y + k / 4) * image.width + x + k % 4;
            image.depth[at] = p.ray.tfar[k];
            image.face[at] = p.hit.geomID[k] == RTC_INVALID_GEOMETRY_ID ? ~0u : p.hit.primID[k];
        }
    }
}

template <class Along> void cast_singly(RTCScene scene, const float* origin, Image& image, Along along) {
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    for (unsigned j = 0; j < image.height; j++)
    for (unsigned i = 0; i < image.width; i++) {
        Direction d = along(i, j);
        RTCRayHit r;
        r.ray.org_x = origin[0], r.ray.org_y = origin[1], r.ray.org_z = origin[2];
        r.ray.dir_x = d.x, r.ray.dir_y = d.y, r.ray.dir_z = d.z;
        r.ray.tnear = 0, r.ray.tfar = INFINITY, r.ray.time = 0;
        r.ray.mask = -1, r.ray.id = 0, r.ray.flags = 0;
        r.hit.geomID = r.hit.primID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        rtcIntersect1(scene, &context, &r);
        size_t at = (size_t)j * image.width + i;
        image.depth[at] = r.ray.tfar;
        image.face[at] = r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? ~0u : r.hit.primID;
    }
}

double user_seconds() {
    rusage r;
    getrusage(RUSAGE_SELF, &r);
    return r.ru_utime.tv_sec + 1e-6 * r.ru_utime.tv_usec;
}

double median(std::vector<double> v) {
    std::sort(v.begin(), v.end());
    return v[v.size() / 2];
}

void time_all(RTCDevice device, const Dump& d, int rounds) {
    RTCScene scene = build(device, d, false);
    Image view(d.width, d.height), pano(d.pano_width, d.pano_height);
    std::vector<Direction> directions(pano.face.size());
    for (unsigned j = 0; j < d.pano_height; j++)
        for (unsigned i = 0; i < d.pano_width; i++) directions[(size_t)j * d.pano_width + i] = direction(d, i, j);
    // By width of the packets: 8 and 16.
    std::vector<double> views[2], panos[2];
    const int PANORAMAS = 3;
    auto cast = [&](int wide, Image& image, auto along) {
        if (wide) cast_packets<16, RTCRayHit16>(scene, d.origin, image, along, rtcIntersect16);
        else cast_packets<8, RTCRayHit8>(scene, d.origin, image, along, rtcIntersect8);
    };
    for (int k = 0; k < rounds; k++)
    for (int wide = 0; wide < 2; wide++) {
        double start = user_seconds();
        for (const View& v : d.cameras) {
            ViewInF32 f;
            for (int n = 0; n < 3; n++)
                f.corner[n] = (float)v.corner[n], f.x_step[n] = (float)v.x_step[n], f.y_step[n] = (float)v.y_step[n];
            cast(wide, view, [&](unsigned i, unsigned j) {
                float x = i + 0.5f, y = j + 0.5f;
                return Direction{f.corner[0] + f.x_step[0] * x + f.y_step[0] * y,
                                 f.corner[1] + f.x_step[1] * x + f.y_step[1] * y,
                                 f.corner[2] + f.x_step[2] * x + f.y_step[2] * y};
            });
        }
        views[wide].push_back(1e-6 * d.views * view.face.size() / (user_seconds() - start));
        start = user_seconds();
        for (int n = 0; n < PANORAMAS; n++)
            cast(wide, pano, [&](unsigned i, unsigned j) { return directions[(size_t)j * d.pano_width + i]; });
        panos[wide].push_back(1e-6 * PANORAMAS * pano.face.size() / (user_seconds() - start));
    }
    auto better = [](std::vector<double>* rates) { return std::max(median(rates[0]), median(rates[1])); };
    printf("views: %.2f Mray/s a core\npanorama: %.2f Mray/s a core\n", better(views), better(panos));
    rtcReleaseScene(scene);
}

// Counts the pixels where Embree names another face at another distance, and lists them.
size_t compare(const Dump& d, const std::string& name, const Image& embree, FILE* list) {
    size_t n = embree.face.size(), other = 0;
    std::vector<unsigned> face = read<unsigned>(d.folder + "/" + name + ".face", n);
    std::vector<float> depth = read<float>(d.folder + "/" + name + ".depth", n);
    for (size_t k = 0; k < n; k++) {
        // A miss is infinitely far: close to nothing but another miss.
        bool close = std::isfinite(depth[k]) && std::fabs(embree.depth[k] - depth[k]) <= 1e-5f * depth[k];
        if (face[k] == embree.face[k] || close) continue;
        other++;
        fprintf(list, "%s,%zu,%zu,%d,%.9g,%d,%.9g\n", name.c_str(), k % embree.width, k / embree.width, (int)face[k],
                depth[k], (int)embree.face[k], embree.depth[k]);
    }
    return other;
}

void compare_all(RTCDevice device, const Dump& d) {
    RTCScene scene = build(device, d, true);
    FILE* list = fopen((d.folder + "/differences.csv").c_str(), "w");
    if (!list) exit(1);
    fprintf(list, "image,column,row,face,depth,embree_face,embree_depth\n");
    Image view(d.width, d.height), pano(d.pano_width, d.pano_height);
    size_t all = 0, worst = 0;
    for (unsigned k = 0; k < d.views; k++) {
        char name[16];
        snprintf(name, sizeof name, "view_%02u", k);
        const View& v = d.cameras[k];
        cast_singly(scene, d.origin, view, [&](unsigned i, unsigned j) { return direction(v, i, j); });
        size_t other = compare(d, name, view, list);
        all += other, worst = std::max(worst, other);
    }
    printf("views: %zu pixels of %zu differ, worst image %.5f %% equal\n", all, d.views * view.face.size(),
           100.0 - 100.0 * worst / view.face.size());
    cast_singly(scene, d.origin, pano, [&](unsigned i, unsigned j) { return direction(d, i, j); });
    size_t other = compare(d, "pano", pano, list);
    printf("panorama: %zu pixels of %zu differ, %.5f %% equal\n", other, pano.face.size(),
           100.0 - 100.0 * other / pano.face.size());
    fclose(list);
    rtcReleaseScene(scene);
}

int main(int argc, char** argv) {
    std::string what = argc > 2 ? argv[1] : "";
    if (what != "time" && what != "compare") {
        fprintf(stderr, "usage: embree_cast time|compare DUMP [ROUNDS=3] [ISA]\n");
        return 2;
    }
    Dump d = read_dump(argv[2]);
    std::string config = "threads=1,set_affinity=0";
    if (argc > 4) config += std::string(",max_isa=") + argv[4];
    RTCDevice device = rtcNewDevice(config.c_str());
    // As Embree's manual advises.
    _MM_SET_FLUSH_ZERO_MODE(_MM_FLUSH_ZERO_ON);
    _MM_SET_DENORMALS_ZERO_MODE(_MM_DENORMALS_ZERO_ON);
    if (what == "time") time_all(device, d, argc > 3 ? std::max(1, atoi(argv[3])) : 3);
    else compare_all(device, d);
    rtcReleaseDevice(device);
}
