//! Tests of the tutorial: its blocks are parts of its files, and its commands work.

use super::TempFolder;
use std::path::Path;

/// The folder of the repository.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// The content of the fenced blocks of a language, each with the number of the chapter.
fn blocks(text: &str, language: &str) -> Vec<(usize, String)> {
    let (mut chapter, mut open, mut list) = (0, false, vec![]);
    for line in text.lines() {
        let number = line.strip_prefix("## ").and_then(|l| l.split('.').next()?.parse().ok());
        chapter = number.unwrap_or(chapter);
        match line {
            _ if line == format!("```{language}") => {
                open = true;
                list.push((chapter, String::new()));
            }
            "```" => open = false,
            _ if open => list.iter_mut().next_back().expect("a block").1 += &format!("{line}\n"),
            _ => {}
        }
    }
    list
}

fn tutorial() -> String {
    std::fs::read_to_string(Path::new(ROOT).join("docs/tutorial.md")).expect("the tutorial")
}

/// Name and text of the scenes, in order.
fn scenes() -> Vec<(String, String)> {
    let folder = std::fs::read_dir(Path::new(ROOT).join("presets/tutorial")).expect("a folder");
    let mut paths: Vec<_> = folder.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let name = |p: &Path| p.file_stem().expect("a name").to_string_lossy().into_owned();
    paths.iter().map(|p| (name(p), std::fs::read_to_string(p).expect("a scene"))).collect()
}

#[test]
fn blocks_are_parts_of_the_files() {
    let scenes = scenes();
    assert_eq!(scenes.len(), 11);
    for (chapter, block) in blocks(&tutorial(), "toml") {
        let (name, text) = &scenes[chapter - 1];
        // A block may leave out whole tables between its parts.
        for part in block.split("\n\n") {
            assert!(text.contains(part.trim_end()), "chapter {chapter}, {name}: {part}");
        }
    }
}

#[test]
fn scenes_run_to_their_end() {
    let folder = TempFolder::new();
    for (name, text) in scenes() {
        folder.write(&format!("{name}.toml"), text);
        folder.grainscope(&["run", &format!("{name}.toml"), "--no-recording"]).exits(0);
        let summary = folder.json(&format!("runs/{name}/summary.json"));
        assert_eq!(summary["ending"], "finished", "{name}");
        assert!(summary["balances"]["power_error"].as_f64() < Some(1e-6), "{name}");
        // Energy is lost only where something moves.
        let energy = summary["balances"]["energy_error"].as_f64().unwrap_or(0.0).abs();
        assert!(energy < 0.02 || summary["max_speed"].as_f64() < Some(1e-9), "{name}: {energy}");
    }
}

#[test]
fn commands_work() {
    let folder = TempFolder::new();
    let presets = folder.path("presets/tutorial");
    std::fs::create_dir_all(&presets).expect("a folder");
    for (name, text) in scenes() {
        std::fs::write(presets.join(format!("{name}.toml")), text).expect("a scene");
    }
    let mut count = 0;
    for (_, block) in blocks(&tutorial(), "sh") {
        for command in block.replace("\\\n", " ").lines() {
            let words: Vec<&str> =
                command.split_whitespace().map(|w| w.trim_matches('"')).collect();
            let mut words = words.strip_prefix(&["grainscope"]).expect("a command").to_vec();
            // Some steps of the runs and some frames of the films are enough here; pages and cost
            // tables have tests of their own.
            match words[0] {
                "explore" | "cost" | "sweep" => continue,
                _ if words.contains(&"--budget") => continue,
                "run" => words.extend(["--steps", "4"]),
                "film" => words.extend(["--frames", "2", "--width", "200"]),
                _ => {}
            }
            // The tutorial shows this error and its remedy.
            let refused = words.contains(&"accuracy.cells=2");
            folder.grainscope(&words).exits(if refused { 3 } else { 0 });
            count += 1;
        }
    }
    assert!(count > 25, "{count}");
    assert!(folder.has("flow.html") && folder.has("both.gif") && folder.has("flow_00000.png"));
}

/// Headings as mdBook and GitHub name them in links.
fn anchors(text: &str) -> Vec<String> {
    let headings = text.lines().filter_map(|l| l.strip_prefix('#'));
    let anchor = |heading: &str| -> String {
        let heading = heading.trim_start_matches('#').trim().to_lowercase();
        let kept = heading.chars().filter(|c| c.is_alphanumeric() || "-_ ".contains(*c));
        kept.map(|c| if c == ' ' { '-' } else { c }).collect()
    };
    headings.map(anchor).collect()
}

#[test]
fn links_of_the_documentation_lead_somewhere() {
    let docs = Path::new(ROOT).join("docs");
    let summary = std::fs::read_to_string(docs.join("SUMMARY.md")).expect("a page");
    let entries = std::fs::read_dir(&docs).expect("a folder").map(|e| e.expect("an entry").path());
    let mut pages: Vec<_> = entries.filter(|p| p.extension().is_some_and(|e| e == "md")).collect();
    for page in &pages {
        let name = page.file_name().expect("a name").to_string_lossy();
        let listed = name == "SUMMARY.md" || summary.contains(&format!("({name})"));
        assert!(listed, "{name} is missing in docs/SUMMARY.md");
    }
    for name in ["README.md", "ARCHITECTURE.md", "python/README.md"] {
        pages.push(Path::new(ROOT).join(name));
    }
    for page in pages {
        let text = std::fs::read_to_string(&page).expect("a page");
        for link in text.split("](").skip(1).filter_map(|part| part.split(')').next()) {
            if link.contains("://") {
                continue;
            }
            // The book has only what is in its folder.
            let in_book = !page.starts_with(&docs) || !link.contains("..");
            assert!(in_book, "{}: {link} leads out of the book", page.display());
            let (file, anchor) = link.split_once('#').unwrap_or((link, ""));
            let target = match file {
                "" => page.clone(),
                _ => page.parent().expect("a folder").join(file),
            };
            assert!(target.exists(), "{}: {link}", page.display());
            let exists = anchor.is_empty()
                || anchors(&std::fs::read_to_string(&target).expect("a page"))
                    .contains(&anchor.into());
            assert!(exists, "{}: {link}", page.display());
        }
    }
}
