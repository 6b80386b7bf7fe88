//! Tests of reports, films, Parquet tables, new scenes and the reference.

use super::TempFolder;

/// A run of a few seconds with particles, dye, fields and a gauge.
fn small(folder: &TempFolder, out: &str, alpha: &str) {
    let alpha = format!("alpha={alpha}");
    let run =
        ["run", "silo", "--set", "accuracy.cells=1", "--set", &alpha, "--steps", "8", "--out", out];
    folder.grainscope(&run).exits(0);
}

/// Height and width in the header of a PNG.
fn size_of_png(bytes: &[u8]) -> [u32; 2] {
    assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
    [16, 20].map(|k| u32::from_be_bytes(bytes[k..k + 4].try_into().expect("four bytes")))
}

#[test]
fn a_report_holds_everything_and_loads_nothing() {
    let folder = TempFolder::new();
    small(&folder, "soft", "0");
    small(&folder, "stiff", "5/3");
    let said = folder.grainscope(&["report", "soft", "stiff", "-o", "both.html"]).exits(0);
    said.prints(&["wrote both.html"]);
    let page = folder.read("both.html");
    assert!(page.len() < 10_000_000, "{}", page.len());
    for part in [
        "soft, stiff",
        "Content-Security-Policy",
        "script-src 'sha256-",
        "grainscope report soft stiff -o both.html",
    ] {
        assert!(page.contains(part), "{part}");
    }
    for loader in ["<script src", "<link", "http://", "fetch("] {
        assert!(!page.replace("http://www.w3.org/2000/svg", "").contains(loader), "{loader}");
    }
    // The data are those of the files, and a text in them cannot end the data.
    let data = page.split("id=\"data\">").nth(1).and_then(|p| p.split("</script>").next());
    let data: serde_json::Value = serde_json::from_str(data.expect("data")).expect("JSON");
    for (k, name) in ["soft", "stiff"].iter().enumerate() {
        assert_eq!(data["runs"][k]["summary"], folder.read(&format!("{name}/summary.json")));
        assert_eq!(data["runs"][k]["scene"], folder.read(&format!("{name}/scene.toml")));
        let frames = data["runs"][k]["frames"].as_array().expect("frames").len();
        assert_eq!(frames, data["runs"][k]["times"].as_array().expect("times").len());
        let rows = data["runs"][k]["series"]["points"].as_array().expect("points").len();
        assert_eq!(rows, folder.read(&format!("{name}/series.csv")).lines().count() - 1);
    }
    // A page of the user is not replaced; one of this program is.
    folder.write("mine.html", "<html>my page</html>");
    let report = ["report", "soft", "-o", "mine.html"];
    folder.grainscope(&report).exits(1).complains(&["left as it is"]);
    assert_eq!(folder.read("mine.html"), "<html>my page</html>");
    folder.grainscope(&["report", "soft", "-o", "both.html"]).exits(0);
}

#[test]
fn commands_write_reports_on_request() {
    let folder = TempFolder::new();
    let run =
        ["run", "silo", "--set", "accuracy.cells=1", "--steps", "3", "--out", "a", "--report"];
    folder.grainscope(&run).exits(0);
    assert!(folder.has("a/report.html"));
    small(&folder, "b", "0");
    folder.grainscope(&["compare", "a", "b", "--report"]).exits(0);
    assert!(folder.has("comparisons/a-vs-b/report.html"));
    // Without a recording there are curves and results, and a note says why there is no flow.
    let run = [
        "run",
        "silo",
        "--set",
        "accuracy.cells=1",
        "--steps",
        "3",
        "--no-recording",
        "--out",
        "c",
    ];
    folder.grainscope(&run).exits(0);
    folder.grainscope(&["report", "c"]).exits(0);
    assert!(folder.read("c/report.html").contains("has no recording"));
}

#[test]
fn films_are_images_of_the_flow() {
    let folder = TempFolder::new();
    small(&folder, "soft", "0");
    small(&folder, "stiff", "5/3");
    folder
        .grainscope(&["film", "soft", "stiff", "-o", "flow.gif", "--width", "400", "--frames", "3"])
        .exits(0);
    let gif = std::fs::read(folder.path("flow.gif")).expect("a film");
    assert_eq!((&gif[..6], gif[6], gif[7]), (&b"GIF89a"[..], 144, 1));
    for (options, name) in [
        (&["--colour", "speed", "--dark"][..], "speed"),
        (&["--field", "pressure", "--no-dye"][..], "pressure"),
        (&[][..], "material"),
    ] {
        let out = format!("{name}.png");
        let film =
            ["film", "stiff", "-o", &out, "--frames", "2", "--width", "320", "--height", "400"];
        folder.grainscope(&[&film[..], options].concat()).exits(0);
        let png = std::fs::read(folder.path(&format!("{name}_00000.png"))).expect("an image");
        assert_eq!(size_of_png(&png), [320, 400]);
        assert!(png.len() > 3000, "{}", png.len());
    }
    // The same frame is the same image.
    let first = std::fs::read(folder.path("material_00001.png")).expect("an image");
    folder
        .grainscope(&[
            "film",
            "stiff",
            "-o",
            "material.png",
            "--frames",
            "2",
            "--width",
            "320",
            "--height",
            "400",
        ])
        .exits(0);
    assert!(std::fs::read(folder.path("material_00001.png")).expect("an image") == first);
    for (arguments, code, says) in [
        (
            &["film", "stiff", "-o", "flow.avi"][..],
            2,
            "expected a name that ends in .gif, .mp4 or .png",
        ),
        (&["film", "stiff", "-o", "x.gif", "--colour", "sped"][..], 2, "expected one of: material"),
        (&["film", "none", "-o", "x.gif"][..], 1, "there is no such file or folder"),
        (&["film", "stiff", "-o", "x.gif", "--fps", "0"][..], 2, "from 0.1 to 100"),
    ] {
        folder.grainscope(arguments).exits(code).complains(&[says]);
    }
    // Without ffmpeg the message says so.
    let no_path =
        folder.command(&["film", "stiff", "-o", "x.mp4"]).env("PATH", "").output().expect("starts");
    assert_eq!(no_path.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&no_path.stderr).contains("MP4 needs the program `ffmpeg`"));
    assert!(!folder.has("x.mp4"));
}

#[test]
fn parquet_tables_are_written() {
    let folder = TempFolder::new();
    small(&folder, "soft", "0");
    let said = folder.grainscope(&["export", "soft", "--format", "parquet"]).exits(0);
    said.prints(&["wrote 3 files"]);
    for name in ["particles", "fields", "series"] {
        let bytes =
            std::fs::read(folder.path(&format!("soft/parquet/{name}.parquet"))).expect("a table");
        assert!(bytes.starts_with(b"PAR1") && bytes.ends_with(b"PAR1"), "{name}");
    }
}

#[test]
fn a_new_scene_is_valid_and_runs() {
    let folder = TempFolder::new();
    folder.grainscope(&["new", "mine"]).exits(0);
    assert!(folder.read("mine.toml").starts_with("#:schema ./grainscope.schema.json"));
    folder.json("grainscope.schema.json");
    folder.grainscope(&["check", "mine.toml"]).exits(0);
    folder.grainscope(&["run", "mine.toml", "--steps", "2", "--set", "accuracy.cells=1"]).exits(0);
    assert!(
        folder.json("runs/mine/summary.json")["gauges"]["outflow"]["volume"].as_f64() > Some(0.0)
    );
    folder.grainscope(&["new", "mine"]).exits(1).complains(&["exists already"]);
    for name in ["../x", "a b", ""] {
        folder.grainscope(&["new", name]).exits(2);
    }
}

#[test]
fn the_reference_of_the_documentation_is_up_to_date() {
    let folder = TempFolder::new();
    let now = folder.grainscope(&["reference"]).exits(0);
    let written =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/reference.md"));
    assert!(
        written.expect("a page").trim_end() == now.out.trim_end(),
        "run: grainscope reference > docs/reference.md"
    );
}
