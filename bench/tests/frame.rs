//! The frame of a report, with a topic that measures nothing: files, schema, bars and failures.

use serde_json::Value;
use vantage_bench::report::plot::{Scatter, Series, draw_scatter};
use vantage_bench::report::write::terminal_text;
use vantage_bench::report::{Bar, Report, Row, Verdict};
use vantage_bench::spread::{Better, Spread};
use vantage_bench::topic::{Run, Topic, run_topic};

struct Fake;

impl Topic for Fake {
    fn name(&self) -> &'static str {
        "fake"
    }

    fn about(&self) -> &'static str {
        "Figures that were made up."
    }

    fn default_scenes(&self, _quick: bool) -> Vec<String> {
        vec!["urban".to_owned()]
    }

    fn run(&self, run: &Run, report: &mut Report) -> anyhow::Result<()> {
        for scene in &run.scenes {
            if scene == "missing.glb" {
                report.rows.push(Row::failed("missing", "quads", &anyhow::anyhow!("no such file")));
                continue;
            }
            let mut row = Row::new(scene, "quads, averaged");
            row.parameters.set("image_px", 512);
            row.error.set("holes_share", Spread::of(&[0.001, 0.003], Better::Lower).expect("two values"));
            row.error.set("psnr_db", Spread::of(&[30.0, 40.0], Better::Higher).expect("two values"));
            row.time_ms.set("surface", Spread::single(12.5));
            row.bytes.set("patch", 1000.0);
            row.counts.set("eyes", 2.0);
            let holes_share = row.error.get("holes_share").map(|spread| spread.mean);
            report.bars.push(Bar::at_most(format!("{scene}: holes"), 0.003, holes_share, "share"));
            report.bars.push(Bar::at_most(format!("{scene}: false cover"), 0.008, Some(0.009), "share"));
            report.rows.push(row);
        }
        let path = run.figure(report, "holes.svg", "Holes against time.");
        let series = vec![Series { name: "quads".to_owned(), points: vec![(12.5, 0.2)] }];
        let plot = Scatter { title: "urban".into(), x_label: "ms".into(), y_label: "holes, %".into(), series };
        draw_scatter(&plot, &path)
    }
}

fn made(scenes: &[&str]) -> (Report, std::path::PathBuf) {
    let out = std::env::temp_dir().join(format!("vantage-frame-{}-{}", scenes.join("-"), std::process::id()));
    let run = Run::new(scenes.iter().map(|scene| (*scene).to_owned()).collect(), out.clone());
    (run_topic(&Fake, &run).expect("the files are written"), out)
}

#[test]
fn the_files_hold_the_figures() {
    let (report, out) = made(&["urban"]);
    let read = |name: &str| std::fs::read_to_string(out.join(name)).expect(name);

    let json: Value = serde_json::from_str(&read("fake.json")).expect("valid JSON");
    for field in ["topic", "commit", "adapter", "cpu", "date", "scene", "settings", "rows", "bars"] {
        assert!(!json[field].is_null(), "{field}");
    }
    let row = &json["rows"][0];
    for field in ["method", "parameters", "error", "time_ms", "bytes", "counts"] {
        assert!(!row[field].is_null(), "{field}");
    }
    assert_eq!(row["error"]["holes_share"]["mean"], 0.002);
    assert_eq!(row["error"]["psnr_db"]["worst"], 30.0);
    assert_eq!(row["time_ms"]["surface"]["median"], 12.5);
    assert_eq!((&json["bars"][0]["verdict"], &json["bars"][1]["verdict"]), (&"PASS".into(), &"MISS".into()));

    let csv = read("fake.csv");
    let mut lines = csv.lines();
    let headings = lines.next().expect("headings");
    assert!(headings.starts_with("scene,method,parameters.image_px,error.holes_share.mean,"), "{headings}");
    assert!(lines.next().expect("a row").starts_with("urban,\"quads, averaged\",512,0.002,"));

    let page = read("index.html");
    for text in
        ["Figures that were made up.", "<img src=\"holes.svg\"", "class=\"miss\"", "1 of 2 met", "quads, averaged"]
    {
        assert!(page.contains(text), "{text}");
    }
    assert!(read("holes.svg").contains("holes, %"));
    assert_eq!(report.bars[1].verdict, Verdict::Miss);
    assert!(!report.has_failures(), "a miss is no failure");
    std::fs::remove_dir_all(out).expect("was written");
}

#[test]
fn a_run_that_could_not_be_made_says_why() {
    let (report, out) = made(&["urban", "missing.glb"]);
    assert!(report.has_failures());
    assert!(terminal_text(&report).contains("FAILED: no such file"));
    std::fs::remove_dir_all(out).expect("was written");
}
