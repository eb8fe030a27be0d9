//! The server of the page, spoken to by plain sockets.

use s3d_annotate::server::{LabelOptions, label};
use s3d_dataset::{Cancel, Context};
use serde_json::{Value, json};
use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::PathBuf;
use std::sync::mpsc;
use std::thread::{self, JoinHandle};
use std::time::Duration;
use tempfile::TempDir;

/// A floor of two faces with a box on it, as an OBJ file whose name has markup.
const MESH: &str = "\
v 0 0 0\nv 4 0 0\nv 4 4 0\nv 0 4 0\n\
v 1 1 0\nv 2 1 0\nv 2 2 0\nv 1 2 0\nv 1 1 1\nv 2 1 1\nv 2 2 1\nv 1 2 1\n\
f 1 2 3\nf 1 3 4\n\
f 9 10 11\nf 9 11 12\nf 5 6 10\nf 5 10 9\nf 6 7 11\nf 6 11 10\nf 7 8 12\nf 7 12 11\nf 8 5 9\nf 8 9 12\n";

const NAME: &str = "a <b>scan<b>.obj";

/// A server on a folder of its own.
struct Server {
    folder: TempDir,
    cancel: Cancel,
    ended: Option<JoinHandle<()>>,
    host: String,
    token: String,
}

impl Server {
    fn start() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mesh = folder.path().join(NAME);
        fs::write(&mesh, MESH).unwrap();

        let cancel = Cancel::default();
        let context = Context::default().cancelled_by(cancel.clone());
        let (told, address) = mpsc::channel();
        let ended = thread::spawn(move || {
            let options = LabelOptions { no_open: true, ..LabelOptions::default() };
            let source = s3d_dataset::export::SceneSource::Meshes {
                paths: vec![mesh],
                up: Some(s3d_io::mesh::UpAxis::Z),
                units: Some(s3d_io::mesh::LengthUnit::Metre),
            };
            label(source, &options, &context, |url| told.send(url.to_owned()).unwrap()).unwrap();
        });
        let url = address.recv_timeout(Duration::from_secs(60)).unwrap();
        let (host, token) = url.strip_prefix("http://").unwrap().split_once('/').unwrap();
        Self { folder, cancel, ended: Some(ended), host: host.into(), token: token.trim_matches('/').into() }
    }

    fn end(&mut self) {
        self.cancel.cancel();
        let ended = self.ended.take().map(JoinHandle::join);
        assert!(ended.is_none_or(|ended| ended.is_ok()) || thread::panicking());
    }

    fn labels(&self) -> PathBuf {
        self.folder.path().join("a <b>scan<b>.labels")
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.host).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(60))).unwrap();
        stream
    }

    /// Sends text as it is, and returns the status and the body of the answer.
    fn send(&self, text: &str) -> (u16, String) {
        let mut stream = self.connect();
        stream.write_all(text.as_bytes()).unwrap();
        answer(stream)
    }

    fn get_with(&self, path: &str, headers: &str) -> (u16, String) {
        self.send(&format!("GET {path} HTTP/1.1\r\n{headers}Connection: close\r\n\r\n"))
    }

    fn get(&self, name: &str) -> (u16, String) {
        self.get_with(&format!("/{}/{name}", self.token), &format!("Host: {}\r\n", self.host))
    }

    fn json(&self, name: &str) -> Value {
        let (status, body) = self.get(name);
        assert_eq!(status, 200, "{name}: {body}");
        serde_json::from_str(&body).unwrap()
    }

    fn post(&self, name: &str, body: &str) -> (u16, Value) {
        let (token, host, length) = (&self.token, &self.host, body.len());
        let text = format!(
            "POST /{token}/{name} HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: {length}\r\n\
             Connection: close\r\n\r\n{body}"
        );
        let (status, body) = self.send(&text);
        (status, serde_json::from_str(&body).unwrap_or(Value::Null))
    }

    fn gesture(&self, revision: u64, gesture: &Value) -> (u16, Value) {
        self.post("gesture", &json!({ "revision": revision, "gesture": gesture }).to_string())
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        self.end();
    }
}

/// Reads an answer until the connection is closed.
fn answer(mut stream: TcpStream) -> (u16, String) {
    let mut text = Vec::new();
    // A connection that is closed at once has an answer all the same.
    let _ = stream.read_to_end(&mut text);
    let text = String::from_utf8_lossy(&text);
    let status = text
        .split(' ')
        .nth(1)
        .and_then(|status| status.parse().ok())
        .unwrap_or(0);
    let body = text.split_once("\r\n\r\n").map_or("", |(_, body)| body);
    (status, body.to_owned())
}

/// The patch at a face, by its segment.
fn what(face: u32, node: u32) -> Value {
    json!({ "patches": [{ "face": face, "node": node }] })
}

#[test]
fn strokes_reach_the_disk_before_the_answer_and_labels_follow_at_the_end() {
    let mut server = Server::start();
    assert!(server.get("").1.contains("<!doctype html>"));
    let scene = server.json("scene.json");
    assert_eq!(
        (&scene["name"], &scene["faces"], &scene["classes"][8]),
        (&json!(NAME), &json!(12), &json!("chair"))
    );

    let segments = fs::read(server.labels().join("segments.json")).unwrap();
    let segments: Value = serde_json::from_slice(&segments).unwrap();
    let nodes = segments["parent"].as_array().unwrap().len();
    assert_eq!((&segments["segIndices"][11], segments["cost"].as_array().unwrap().len()), (&json!(5), nodes));
    assert_eq!(scene["nodes"], nodes);

    let chair = json!({ "label": { "what": what(0, 0), "class": "chair" } });
    let (status, done) = server.gesture(0, &chair);
    assert_eq!(
        (status, &done["state"]["revision"], &done["changed"]),
        (200, &json!(1), &json!([[1, [0, 2]]]))
    );
    let log = fs::read_to_string(server.labels().join("events.jsonl")).unwrap();
    assert_eq!(log.lines().count(), 2);
    assert!(log.contains(r#""paint":{"faces":[0,2],"instance":1,"class":"chair"}"#), "{log}");

    // Another window has not seen it yet.
    let (status, refused) = server.gesture(0, &chair);
    assert_eq!((status, &refused["revision"]), (409, &json!(1)));
    let (status, refused) = server.gesture(1, &json!({ "class": { "instance": 1, "class": "<i>x</i>" } }));
    assert_eq!(status, 422, "{refused}");
    assert_eq!(server.gesture(1, &json!("redo")).0, 422);
    assert_eq!(server.gesture(1, &json!("undo")).0, 200);
    assert_eq!(server.gesture(2, &json!("redo")).0, 200);
    for body in ["", "{", "[]", r#"{"revision":3}"#, r#"{"revision":3,"gesture":"fly"}"#] {
        assert_eq!(server.post("gesture", body).0, 400, "{body}");
    }
    assert_eq!(server.json("state.json")["instances"][0]["name"], "chair_1");

    assert!(!server.labels().join("labels.npz").exists());
    server.end();
    let saved = s3d_io::cloud::SavedLabels::read(&server.labels()).unwrap();
    assert_eq!((saved.revision, &saved.instance[..3]), (3, &[1, 1, -1][..]));
}

#[test]
fn labels_are_written_on_request_and_a_folder_is_labelled_by_one_process() {
    let server = Server::start();
    let chair = json!({ "label": { "what": what(0, 0), "class": "chair" } });
    assert_eq!(server.gesture(0, &chair).0, 200);
    assert_eq!(server.post("save", "").1["saved"], json!(["labels.npz", "rooms.json"]));
    let saved = s3d_io::cloud::SavedLabels::read(&server.labels()).unwrap();
    assert_eq!((saved.revision, &saved.instances[..]), (1, &[(1, "chair_1".to_owned())][..]));
    let (status, written) = server.post("write", r#"{"format":"ply"}"#);
    assert_eq!(status, 200, "{written}");
    assert!(server.folder.path().join("a <b>scan<b>_labelled.ply").is_file(), "{written}");

    let options = LabelOptions { no_open: true, output: Some(server.labels()), ..LabelOptions::default() };
    let mesh = server.folder.path().join(NAME);
    let source = s3d_dataset::export::SceneSource::Meshes {
        paths: vec![mesh],
        up: Some(s3d_io::mesh::UpAxis::Z),
        units: Some(s3d_io::mesh::LengthUnit::Metre),
    };
    let refused = label(source, &options, &Context::default(), |_| panic!("served twice"));
    assert!(refused.unwrap_err().to_string().contains("another process"));
}

#[test]
fn every_address_of_the_page_answers() {
    let server = Server::start();
    for (name, bytes) in [
        ("positions.bin", 12 * 12),
        ("faces.bin", 12 * 12),
        ("materials.bin", 2 * 12),
        ("segments.bin", 4 * 12),
        ("labels.bin", 4 * 12),
    ] {
        let mut stream = server.connect();
        let (token, host) = (&server.token, &server.host);
        write!(stream, "GET /{token}/{name} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").unwrap();
        let mut content = Vec::new();
        stream.read_to_end(&mut content).unwrap();
        let head = content.windows(4).position(|w| w == b"\r\n\r\n").unwrap() + 4;
        assert_eq!(content.len() - head, bytes, "{name}");
    }
    assert_eq!(server.json("doubt.json?not=99")["doubt"]["face"], 0);
    assert!(server.json("checks.json")["checks"].is_array());
    assert!(server.json("similar.json?instance=1")["patches"].is_array());
    let cut =
        |face: u32| format!(r#"{{"at":{{"face":{face},"node":0}},"by":{{"color":{{"tolerance":0.1}}}}}}"#);
    let (status, told) = server.post("cut", &cut(0));
    assert_eq!((status, &told["faces"]), (200, &serde_json::json!([0, 2])));
    assert_eq!(server.post("cut", &cut(99)).0, 422);
    assert_eq!(server.post("cut", "{}").0, 400);
    // The structure takes its time.
    let structure = (0..600).find_map(|_| match server.get("structure.json") {
        (200, body) => Some(body),
        (status, body) => {
            assert_eq!(status, 503, "{body}");
            thread::sleep(Duration::from_millis(100));
            None
        }
    });
    assert!(structure.unwrap().contains(r#""surfaces""#));
    for missing in ["colors.bin", "uv.bin", "texture/0", "photograph/0"] {
        assert_eq!(server.get(missing).0, 404, "{missing}");
    }
}

#[test]
fn requests_of_others_are_refused() {
    let server = Server::start();
    let (host, token) = (server.host.clone(), server.token.clone());
    let port = host.split(':').nth(1).unwrap();
    let own = format!("Host: {host}\r\n");
    let state = format!("/{token}/state.json");
    assert_eq!(server.get_with(&state, &own).0, 200);
    assert_eq!(server.get_with(&state, &format!("Host: localhost:{port}\r\n")).0, 200);

    // Other hosts, such as names that lead here, and other pages.
    for headers in [
        "Host: example.com\r\n".to_owned(),
        format!("Host: example.com:{port}\r\n"),
        "Host: 127.0.0.1\r\n".to_owned(),
        format!("Host: 127.0.0.1.example.com:{port}\r\n"),
        format!("{own}Host: example.com\r\n"),
        format!("{own}Origin: http://example.com\r\n"),
        format!("{own}Origin: null\r\n"),
        format!("{own}Origin: https://{host}\r\n"),
        format!("{own}Origin: http://{host}\r\nOrigin: http://example.com\r\n"),
        format!("{own}Origin: http://{host}.example.com\r\n"),
    ] {
        let (status, body) = server.get_with(&state, &headers);
        assert!(status == 403 || status == 400, "{headers}: {status} {body}");
        assert!(!body.contains("revision"), "{headers}");
    }
    assert_eq!(server.get_with(&state, "").0, 403);

    // Addresses without the token, or that lead elsewhere.
    let wrong = "0".repeat(token.len());
    for path in [
        "/".to_owned(),
        "/state.json".to_owned(),
        format!("/{wrong}/state.json"),
        format!("/{token}"),
        format!("/{token}/../{token}/state.json"),
        format!("/{token}/../../etc/passwd"),
        format!("/{token}/%2e%2e/%2e%2e/etc/passwd"),
        format!("/{token}/texture/../../etc/passwd"),
        format!("/{token}/events.jsonl"),
        format!("//{token}/state.json"),
    ] {
        let (status, body) = server.get_with(&path, &own);
        assert!(status == 404 || status == 400, "{path}: {status} {body}");
    }
    // Reading changes nothing.
    assert_eq!(server.get_with(&format!("/{token}/gesture"), &own).0, 405);
}

#[test]
fn floods_are_bounded() {
    let server = Server::start();
    let (host, token) = (&server.host, &server.token);

    // A body of 10 GB that is announced, and one that is not.
    let head = format!("POST /{token}/gesture HTTP/1.1\r\nHost: {host}\r\n");
    assert_eq!(server.send(&format!("{head}Content-Length: 10000000000\r\n\r\n")).0, 413);
    let mut stream = server.connect();
    stream.set_write_timeout(Some(Duration::from_secs(5))).unwrap();
    write!(stream, "{head}Transfer-Encoding: chunked\r\n\r\n").unwrap();
    let chunk = format!("{:x}\r\n{}\r\n", 1 << 20, " ".repeat(1 << 20));
    let sent = (0..1000)
        .take_while(|_| stream.write_all(chunk.as_bytes()).is_ok())
        .count();
    assert!(sent < 1000, "a body has no end");
    drop(stream);

    // A thousand connections that say nothing: the system refuses most of them, and the page is answered when
    // they are gone.
    let (address, patience) = (host.parse().unwrap(), Duration::from_millis(200));
    let connect = |_| TcpStream::connect_timeout(&address, patience).ok();
    let idle: Vec<TcpStream> = (0..1000).map_while(connect).collect();
    assert!(idle.len() >= 64, "{}", idle.len());
    drop(idle);
    assert_eq!(server.get("state.json").0, 200);

    // A thousand requests at once: each is answered.
    thread::scope(|scope| {
        for _ in 0..20 {
            scope.spawn(|| (0..50).for_each(|_| assert_eq!(server.get("state.json").0, 200)));
        }
    });
}

#[test]
fn labels_are_carried_over_into_a_new_folder_only() {
    let mut server = Server::start();
    let chair = json!({ "label": { "what": what(0, 0), "class": "chair" } });
    assert_eq!(server.gesture(0, &chair).0, 200);
    server.end();

    let old = server.folder.path().join(NAME);
    let options = LabelOptions {
        carry_over: vec![old.clone(), server.labels()],
        output: Some(server.folder.path().join("new.labels")),
        write: Some(s3d_annotate::outputs::OutputFormat::Ply),
        ..LabelOptions::default()
    };
    let context = Context::default();
    label(old.clone(), &options, &context, |path| assert!(path.ends_with("new_labelled.ply"))).unwrap();
    let log = fs::read_to_string(server.folder.path().join("new.labels/events.jsonl")).unwrap();
    assert!(log.contains("chair"), "{log}");

    let again = label(old, &options, &context, |_| panic!("labels were replaced")).unwrap_err();
    assert!(again.to_string().contains("has labels already"), "{again}");
}
