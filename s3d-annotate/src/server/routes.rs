//! Addresses, and the calls that they mean.

use super::answers::{
    CutWish, DoneOf, MaterialOf, PhotographOf, ProposalsOf, RefusalOf, SceneOf, SurfaceOf, Wish, WriteWish,
};
use super::desk::Desk;
use super::guard::{Guard, MOST_BYTES, guarded};
use super::mesh_bytes;
use crate::labelling::Error;
use crate::segments::MergeTree;
use axum::body::Bytes;
use axum::extract::{DefaultBodyLimit, Path, RawQuery, State};
use axum::http::{StatusCode, header};
use axum::middleware::from_fn_with_state;
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use jpeg_encoder::{ColorType, Encoder, EncodingError};
use s3d_geom::Raster;
use serde::Serialize;
use serde_json::json;
use std::sync::Arc;

/// The page, made of the sources in `web/`.
const PAGE: &str = include_str!("page.html");

/// Photographs are shown with this width at most.
const PHOTOGRAPH_PX: u32 = 4096;

/// The quality of JPEG files, 1 to 100.
const QUALITY: u8 = 88;

/// An answer, or why there is none.
type Answer = Result<Response, Refusal>;

/// Why a request is refused.
struct Refusal(StatusCode, RefusalOf);

impl Refusal {
    fn new(status: StatusCode, error: impl ToString) -> Self {
        Self(status, RefusalOf { error: error.to_string(), revision: None })
    }

    fn missing(what: &str) -> Self {
        Self::new(StatusCode::NOT_FOUND, format!("there is no {what}"))
    }

    fn failed(error: impl ToString) -> Self {
        Self::new(StatusCode::INTERNAL_SERVER_ERROR, error)
    }
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        let (status, revision) = match &error {
            Error::Stale { now, .. } => (StatusCode::CONFLICT, Some(*now)),
            Error::Fault(_) | Error::Class(_) | Error::RoomType(_) => {
                (StatusCode::UNPROCESSABLE_ENTITY, None)
            }
            _ => (StatusCode::INTERNAL_SERVER_ERROR, None),
        };
        Self(status, RefusalOf { error: error.to_string(), revision })
    }
}

impl IntoResponse for Refusal {
    fn into_response(self) -> Response {
        (self.0, Json(self.1)).into_response()
    }
}

/// Returns the service of a desk. Its addresses begin with the token.
pub(super) fn routes(desk: Arc<Desk>, token: &str, guard: Guard) -> Router {
    let at = |name: &str| format!("/{token}/{name}");
    Router::new()
        .route(&at(""), get(page))
        .route(&at("scene.json"), get(|desk| with(desk, scene)))
        .route(&at("positions.bin"), get(|desk| with(desk, |d| bytes(mesh_bytes::positions(d.mesh())))))
        .route(&at("faces.bin"), get(|desk| with(desk, |d| bytes(mesh_bytes::faces(d.mesh())))))
        .route(&at("colors.bin"), get(|desk| with(desk, |d| there("colour", mesh_bytes::colors(d.mesh())))))
        .route(&at("uv.bin"), get(|desk| with(desk, |d| there("texture", mesh_bytes::uvs(d.mesh())))))
        .route(&at("materials.bin"), get(|desk| with(desk, |d| bytes(mesh_bytes::materials(d.mesh()).1))))
        .route(&at("texture/{number}"), get(texture))
        .route(&at("photograph/{number}"), get(photograph))
        .route(&at("segments.bin"), get(|desk| with(desk, segments)))
        .route(&at("tree.bin"), get(|desk| with(desk, tree)))
        .route(&at("structure.json"), get(|desk| with(desk, structure)))
        .route(&at("state.json"), get(|desk| with(desk, |d| json(&d.state()))))
        .route(&at("labels.bin"), get(|desk| with(desk, labels)))
        .route(&at("doubt.json"), get(doubt))
        .route(&at("similar.json"), get(similar))
        .route(&at("checks.json"), get(|desk| with(desk, checks)))
        .route(&at("gesture"), post(gesture))
        .route(&at("cut"), post(cut))
        .route(&at("save"), post(|desk| with(desk, save)))
        .route(&at("write"), post(write))
        .fallback(|| async { Refusal::missing("such address") })
        .layer(DefaultBodyLimit::max(MOST_BYTES))
        .layer(from_fn_with_state(guard, guarded))
        .with_state(desk)
}

/// Makes a call where it may take its time.
async fn with(
    State(desk): State<Arc<Desk>>,
    call: impl FnOnce(&Desk) -> Answer + Send + 'static,
) -> Response {
    let answered = tokio::task::spawn_blocking(move || call(&desk)).await;
    answered
        .unwrap_or_else(|_| Err(Refusal::failed("the call failed")))
        .into_response()
}

#[expect(clippy::unnecessary_wraps, reason = "it ends calls that may be refused")]
fn json(value: &impl Serialize) -> Answer {
    Ok(Json(value).into_response())
}

#[expect(clippy::unnecessary_wraps, reason = "it ends calls that may be refused")]
fn bytes(bytes: Vec<u8>) -> Answer {
    Ok(([(header::CONTENT_TYPE, "application/octet-stream")], bytes).into_response())
}

fn there(what: &str, content: Vec<u8>) -> Answer {
    if content.is_empty() {
        Err(Refusal::missing(what))
    } else {
        bytes(content)
    }
}

fn numbers(numbers: impl Iterator<Item = u32>) -> Vec<u8> {
    numbers.flat_map(u32::to_le_bytes).collect()
}

async fn page() -> Response {
    ([(header::CONTENT_TYPE, "text/html; charset=utf-8")], PAGE).into_response()
}

fn scene(desk: &Desk) -> Answer {
    let bench = desk.bench();
    let mesh = bench.mesh();
    let taxonomy = bench.labels().taxonomy();
    let bounds = mesh.aabb();
    let (materials, _) = mesh_bytes::materials(mesh);
    let material = |(color, texture)| MaterialOf { color, texture };
    let photographs = desk.scene.panoramas().into_iter().map(|panorama| PhotographOf {
        name: panorama.name,
        at: panorama.location.to_array(),
        kind: "panorama",
    });
    json(&SceneOf {
        name: &desk.name,
        folder: bench.labels().path().display().to_string(),
        version: env!("CARGO_PKG_VERSION"),
        faces: mesh.faces().len(),
        vertices: mesh.positions().len(),
        origin: mesh_bytes::origin(mesh).to_array(),
        bounds: [bounds.min.to_array(), bounds.max.to_array()],
        classes: taxonomy.classes().iter().map(|class| class.name()).collect(),
        room_types: taxonomy.room_types().iter().map(|kind| kind.name()).collect(),
        has_colors: !mesh.parts().colors.is_empty(),
        materials: materials.into_iter().map(material).collect(),
        textures: mesh.textures().len(),
        nodes: bench.segments().tree.node_count(),
        segments: bench.segments().tree.leaf_count(),
        photographs: photographs.collect(),
        warnings: &desk.warnings,
    })
}

fn segments(desk: &Desk) -> Answer {
    bytes(numbers(desk.bench().segments().segment_of_face.iter().copied()))
}

fn tree(desk: &Desk) -> Answer {
    let segments = Arc::clone(desk.bench().segments());
    let tree: &MergeTree = &segments.tree;
    let nodes = 0..tree.node_count();
    let mut content = numbers(nodes.clone().map(|node| tree.parent(node).unwrap_or(u32::MAX)));
    content.extend(nodes.flat_map(|node| tree.cost(node).to_le_bytes()));
    bytes(content)
}

fn labels(desk: &Desk) -> Answer {
    bytes(numbers(desk.bench().labels().state().instance_of_face().iter().copied()))
}

fn structure(desk: &Desk) -> Answer {
    if !desk.is_structure_found() {
        let why = "floors, walls and rooms are still being found";
        return Err(Refusal::new(StatusCode::SERVICE_UNAVAILABLE, why));
    }
    let bench = desk.bench();
    let proposals = bench.proposals();
    let surfaces = proposals.surfaces.iter().map(|surface| SurfaceOf {
        class: surface.class.clone(),
        faces: surface.faces.clone(),
        room: surface.room,
        area_m2: surface.faces.iter().map(|face| bench.mesh().area(face)).sum(),
        source: surface.source.clone(),
    });
    json(&ProposalsOf { surfaces: surfaces.collect(), rooms: proposals.rooms.clone() })
}

fn checks(desk: &Desk) -> Answer {
    json(&json!({ "checks": desk.review(|review| review.checks()) }))
}

/// The numbers that a query gives a name, such as `not=1,2`. Others are left out.
fn asked(query: Option<String>, name: &str) -> Vec<u32> {
    let query = query.unwrap_or_default();
    let values = query
        .split('&')
        .filter_map(|pair| pair.strip_prefix(name)?.strip_prefix('='));
    values
        .flat_map(|list| list.split(','))
        .filter_map(|number| number.parse().ok())
        .collect()
}

async fn doubt(desk: State<Arc<Desk>>, RawQuery(query): RawQuery) -> Response {
    with(desk, move |desk| {
        let skipped = asked(query, "not");
        json(&json!({ "doubt": desk.review(|review| review.next_doubt(&skipped)) }))
    })
    .await
}

async fn similar(desk: State<Arc<Desk>>, RawQuery(query): RawQuery) -> Response {
    with(desk, move |desk| match asked(query, "instance")[..] {
        [instance] => json(&json!({ "patches": desk.review(|review| review.similar_patches(instance)) })),
        _ => Err(Refusal::new(StatusCode::BAD_REQUEST, "name one instance: similar.json?instance=7")),
    })
    .await
}

async fn texture(desk: State<Arc<Desk>>, Path(number): Path<usize>) -> Response {
    with(desk, move |desk| {
        let texture = desk.mesh().textures().get(number);
        jpeg(&texture.ok_or_else(|| Refusal::missing("such texture"))?.image)
    })
    .await
}

async fn photograph(desk: State<Arc<Desk>>, Path(number): Path<usize>) -> Response {
    with(desk, move |desk| {
        let image = desk.scene.panorama(number, PHOTOGRAPH_PX).map_err(Refusal::failed)?;
        jpeg(&image.ok_or_else(|| Refusal::missing("such photograph"))?)
    })
    .await
}

fn jpeg(image: &Raster<[u8; 3]>) -> Answer {
    if image.width().max(image.height()) > u32::from(u16::MAX) {
        return Err(Refusal::failed("the picture has sides of more than 65,535 pixels"));
    }
    let mut content = Vec::new();
    encode(image, &mut content).map_err(Refusal::failed)?;
    Ok(([(header::CONTENT_TYPE, "image/jpeg")], content).into_response())
}

fn encode(image: &Raster<[u8; 3]>, to: &mut Vec<u8>) -> Result<(), EncodingError> {
    let [width, height] = [image.width(), image.height()].map(|side| side as u16);
    Encoder::new(to, QUALITY).encode(image.pixels().as_flattened(), width, height, ColorType::Rgb)
}

/// The wish in the body of a request.
fn wish<T: for<'w> serde::Deserialize<'w>>(body: &[u8]) -> Result<T, Refusal> {
    serde_json::from_slice(body)
        .map_err(|e| Refusal::new(StatusCode::BAD_REQUEST, format!("not understood: {e}")))
}

async fn gesture(desk: State<Arc<Desk>>, body: Bytes) -> Response {
    with(desk, move |desk| {
        let Wish { revision, gesture } = wish(&body)?;
        let (change, state) = desk.perform(revision, &gesture)?;
        json(&DoneOf { state, changed: change.faces })
    })
    .await
}

async fn cut(desk: State<Arc<Desk>>, body: Bytes) -> Response {
    with(desk, move |desk| {
        let CutWish { at, by } = wish(&body)?;
        json(&json!({ "faces": desk.cut(at, &by)? }))
    })
    .await
}

fn save(desk: &Desk) -> Answer {
    desk.save(true)?;
    json(&json!({ "saved": ["labels.npz", "rooms.json"] }))
}

async fn write(desk: State<Arc<Desk>>, body: Bytes) -> Response {
    with(desk, move |desk| {
        let WriteWish { format } = wish(&body)?;
        let refused = |e: s3d_dataset::Error| Refusal::new(StatusCode::UNPROCESSABLE_ENTITY, e);
        let written = desk.write(format).map_err(refused)?;
        json(&json!({ "written": written.display().to_string() }))
    })
    .await
}
