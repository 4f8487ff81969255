use std::io::Write;

use axum::body::Bytes;
use futures_util::{StreamExt, stream};
use zip::ZipWriter;
use zip::write::SimpleFileOptions;

use super::*;

const TRIANGLE: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
const IDLE: Duration = Duration::from_secs(60);

fn limits() -> UploadLimits {
    let pause = Duration::from_millis(200);
    UploadLimits { bytes: 4096, all_bytes: 10_000, files: 4, at_once: 2, pause, ..UploadLimits::default() }
}

fn uploads() -> Arc<Uploads> {
    Arc::new(Uploads::open(&std::env::temp_dir(), limits()).expect("a folder"))
}

/// A body of files.
fn body(files: &[(&str, &[u8])]) -> Vec<u8> {
    let listed: Vec<_> =
        files.iter().map(|(path, bytes)| serde_json::json!({ "path": path, "bytes": bytes.len() })).collect();
    let mut body = serde_json::to_vec(&listed).expect("JSON");
    body.push(b'\n');
    files.iter().for_each(|(_, bytes)| body.extend_from_slice(bytes));
    body
}

async fn brought(uploads: &Arc<Uploads>, body: Vec<u8>) -> Result<Vec<String>, NotTaken> {
    // In pieces that end anywhere.
    let pieces: Vec<_> = body.chunks(7).map(|piece| Ok::<_, std::io::Error>(Bytes::copy_from_slice(piece))).collect();
    receive(uploads, axum::body::Body::from_stream(stream::iter(pieces))).await
}

fn zipped(files: &[(&str, &[u8])]) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    let mut archive = ZipWriter::new(&mut bytes);
    for (path, contents) in files {
        archive.start_file(*path, SimpleFileOptions::default()).expect("an entry");
        archive.write_all(contents).expect("written");
    }
    archive.finish().expect("an archive");
    bytes.into_inner()
}

fn lies_there(uploads: &Uploads) -> usize {
    std::fs::read_dir(&uploads.folder).expect("a folder").count()
}

#[tokio::test]
async fn files_that_belong_together_lie_together_and_go_together() {
    let uploads = uploads();
    let files: [(&str, &[u8]); 3] =
        [("car/a b.obj", TRIANGLE), ("car/paint.mtl", b"newmtl x\n"), ("top.OBJ", TRIANGLE)];
    let names = brought(&uploads, body(&files)).await.expect("taken");
    let [top, car] = names.as_slice() else { panic!("{names:?}") };
    assert!(is_brought(top) && top.ends_with("/top") && car.ends_with("/car/a b"), "{names:?}");
    let path = uploads.file(car).expect("its file");
    assert_eq!(std::fs::read(&path).expect("a file"), TRIANGLE);
    assert_eq!(std::fs::read(path.with_file_name("paint.mtl")).expect("a file"), b"newmtl x\n");
    let said = uploads.without_its_path(&format!("{} is bad, as {} is", path.display(), path.display()));
    assert_eq!(said, "car/a b.obj is bad, as car/a b.obj is");
    for strange in ["brought/", "brought/x/top", "brought/../top", "top"] {
        assert_eq!(uploads.file(strange), None, "{strange}");
    }
    let later = Instant::now() + IDLE;
    uploads.tidy(later, IDLE, |prefix| car.starts_with(prefix));
    assert!(uploads.file(car).is_some(), "somebody is there");
    uploads.tidy(Instant::now() + IDLE, IDLE, |_| false);
    assert_eq!((uploads.file(car), lies_there(&uploads)), (None, 0));
    assert_eq!(uploads.bytes.load(Ordering::SeqCst), 0);
}

#[tokio::test]
async fn what_is_packed_is_unpacked_within_limits() {
    let uploads = uploads();
    let packed = zipped(&[("a/b.obj", TRIANGLE), ("a/b.mtl", b"newmtl x\n")]);
    let names = brought(&uploads, body(&[("model.ZIP", &packed)])).await.expect("taken");
    assert!(names.len() == 1 && names[0].ends_with("/a/b"), "{names:?}");
    let zeros = vec![0; 1 << 20];
    let bomb = zipped(&[("a.obj", &zeros)]);
    assert!(bomb.len() < 4096, "{} bytes", bomb.len());
    let many: Vec<_> = ["a", "b", "c", "d", "e"].map(|name| (name, b"".as_slice())).into();
    for (packed, is_right) in [
        (bomb, (|error| matches!(error, NotTaken::Large { most: 4096, .. })) as fn(&NotTaken) -> bool),
        (zipped(&many), |error| matches!(error, NotTaken::Many { files: 5, most: 4 })),
        (zipped(&[("../a.obj", TRIANGLE)]), |error| matches!(error, NotTaken::Path(_))),
        (zipped(&[("it.zip", TRIANGLE)]), |error| matches!(error, NotTaken::Archive(_))),
        (zipped(&[("notes.txt", b"")]), |error| matches!(error, NotTaken::NoScene)),
        (b"PK and no more".to_vec(), |error| matches!(error, NotTaken::Archive(_))),
    ] {
        let error = brought(&uploads, body(&[("it.zip", &packed)])).await.expect_err("not taken");
        assert!(is_right(&error), "{error}");
    }
    assert_eq!(lies_there(&uploads), 1, "nothing is left of what was not taken");
}

#[tokio::test]
async fn what_is_too_much_or_no_upload_leaves_nothing() {
    let uploads = uploads();
    let large = vec![b' '; 4097];
    let mut short = body(&[("a.obj", TRIANGLE)]);
    short.pop();
    let mut long = body(&[("a.obj", TRIANGLE)]);
    long.push(b' ');
    for (body, word) in [
        (body(&[("a.obj", &large)]), "one upload may have"),
        (body(&[("../a.obj", TRIANGLE)]), "is no path"),
        (body(&[("a.obj", TRIANGLE), ("a.obj", TRIANGLE)]), "cannot be kept"),
        (body(&[("a.txt", TRIANGLE)]), "no scene file"),
        (
            br#"[{"path": "a.obj", "bytes": 18446744073709551615}, {"path": "b", "bytes": 9}]"#.to_vec(),
            "lists its files",
        ),
        (
            [br#"[{"path": "a.obj", "bytes": 18446744073709551615}, {"path": "b", "bytes": 9}]"#.as_slice(), b"\n"]
                .concat(),
            "may have",
        ),
        (vec![b'['; (1 << 20) + 8], "none within 1024 KiB"),
        (short, "not those that it lists"),
        (long, "not those that it lists"),
        (Vec::new(), "lists its files"),
    ] {
        let error = brought(&uploads, body).await.expect_err(word).to_string();
        assert!(error.contains(word), "{error}, not {word}");
    }
    assert_eq!((lies_there(&uploads), uploads.bytes.load(Ordering::SeqCst)), (0, 0));
    // All that is kept together has a limit, and so have those who bring something.
    let most = vec![b' '; 4000];
    for _ in 0..2 {
        brought(&uploads, body(&[("a.obj", &most)])).await.expect("taken");
    }
    let error = brought(&uploads, body(&[("a.obj", &most)])).await.expect_err("there is no room");
    assert!(matches!(error, NotTaken::Full), "{error}");
    let bringing = [uploads.begin(1).expect("a place"), uploads.begin(1).expect("a place")];
    assert!(matches!(uploads.begin(1), Err(NotTaken::Crowded)));
    drop(bringing);
    assert_eq!(lies_there(&uploads), 2);
}

#[tokio::test]
async fn who_stops_sending_is_not_waited_for() {
    let uploads = uploads();
    let begun = Bytes::from(body(&[("a.obj", TRIANGLE)])[..40].to_vec());
    let stops = stream::iter([Ok::<_, std::io::Error>(begun)]).chain(stream::pending());
    let error = receive(&uploads, axum::body::Body::from_stream(stops)).await.expect_err("it never ends");
    assert!(matches!(error, NotTaken::Slow(_)), "{error}");
    assert_eq!(lies_there(&uploads), 0);
    let folder = uploads.folder.clone();
    drop(uploads);
    assert!(!folder.exists(), "nothing stays once the server ends");
}
