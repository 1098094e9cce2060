//! `turbid report` in a browser, and the live pages of `turbid run --serve` and `turbid watch`.

use crate::common::case;
use crate::common::child::{Guard, poll};
use crate::common::{Browser, Place};
use serde_json::json;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;

/// Thirty spheres with rows, pictures and, as the text of the case, what must not become part of a page.
fn crowd(steps: u64) -> String {
    let output = "series_every = { steps = 4 }\nfields_every = \"never\"\nparticles_every = \"never\"\n\
                  picture_every = { steps = 8 }";
    let averages = [("end = {", "average_from = { steps = 0 }\nend = {")];
    let case = case::changed(&case::crowd(steps, output), &averages);
    format!("# </code></pre><script>window.evil = 1</script><img src=x onerror='window.evil = 1'>\n{case}")
}

fn file(path: &Path) -> String {
    format!("file://{}", path.display())
}

/// Cells of a column of the first table with this heading.
fn column(browser: &mut Browser, at: usize) -> Vec<String> {
    let cells = browser.value(&format!(
        "[...document.querySelectorAll('table')[0].tBodies[0].rows].map((row) => row.cells[{at}].textContent)"
    ));
    serde_json::from_value(cells).unwrap()
}

#[test]
fn a_report_in_a_browser_sorts_plays_shows_values_and_fits_a_telephone() {
    let Some(mut browser) = Browser::start() else { return };
    let place = Place::new(&crowd(48));
    place.well(&["run", "case.toml", "--quiet"]);
    place.well(&["report", "out"]);
    let page = file(&place.path("out/report.html"));
    for width in [400, 1600] {
        browser.open(&page, width);
        browser.fits();
    }
    assert_eq!(
        browser.value("[window.evil, document.querySelector('pre').textContent.includes('<script>')]"),
        json!([null, true])
    );
    assert!(browser.value("document.querySelectorAll('figure svg').length").as_u64() > Some(4));

    // Sorted by a click, and the other way by a key on the same button.
    let names = column(&mut browser, 0);
    let mut sorted = names.clone();
    sorted.sort_by_key(|name| name.to_lowercase());
    browser.click("th button");
    assert_eq!(column(&mut browser, 0)[0], sorted[0]);
    assert_eq!(browser.value("document.querySelector('th').getAttribute('aria-sort')"), "ascending");
    browser.key("Enter");
    assert_eq!(column(&mut browser, 0)[0], sorted[sorted.len() - 1]);

    // The slider begins at the last picture.
    let shown = "document.querySelector('.film .view').src";
    let last = browser.value(shown);
    browser.value("document.querySelector('.film input').focus()");
    browser.key("ArrowLeft");
    assert_ne!(browser.value(shown), last);
    assert!(
        browser
            .value("document.querySelector('.film output').textContent")
            .as_str()
            .unwrap()
            .starts_with("step 40, t = ")
    );
    browser.click(".film button");
    browser.wait(&format!("{shown} === {last}"));

    // The value under the pointer is one of the series; keys lead to the next one.
    let tip = "document.querySelector('figure .tip').textContent";
    assert_eq!(browser.value("document.querySelector('figure .tip').hidden"), true);
    browser.mouse("figure .plot svg", [0.6, 0.5], false);
    let read = browser.value(tip);
    let series = place.text("out/series.csv");
    let is_in_series = |text: &str| {
        let words: Vec<&str> = text.split(": ").collect();
        let near = |word: &str| {
            let wanted: f64 =
                word.split(|c: char| !"0123456789.e-+".contains(c)).next().unwrap().parse().unwrap();
            let mut numbers = series
                .lines()
                .skip(1)
                .flat_map(|line| line.split(','))
                .map(|word| word.parse::<f64>().unwrap());
            numbers.any(|number| (number - wanted).abs() <= 1e-4 * number.abs())
        };
        words.len() == 3 && near(words[1]) && near(words[2])
    };
    assert!(is_in_series(read.as_str().unwrap()), "{read}");
    browser.value("document.querySelector('figure .plot').focus()");
    browser.key("ArrowRight");
    let next = browser.value(tip);
    assert!(next != read && is_in_series(next.as_str().unwrap()), "{next}");
    browser.tabs_reach_all();
    browser.has_no_faults();
}

#[test]
fn the_runs_of_a_study_are_filtered_on_its_page() {
    let Some(mut browser) = Browser::start() else { return };
    let place = Place::empty();
    let study = json!({
        "title": "A <b>study</b>", "version": "0.1.0", "command": "turbid study study.toml", "figures": [], "tables": [],
        "checks": [], "runs": { "done": 12, "total": 12, "seconds_spent": 1.0, "seconds_left": 0.0 },
    });
    place.write("study.json", study.to_string());
    let rows =
        (0..12).map(|run| format!("run-{run},{},{}\n", ["cubes", "spheres"][run % 2], 100 * (run / 4)));
    place.write("result.csv", format!("run,shape,archimedes\n{}", rows.collect::<String>()));
    std::fs::create_dir(place.path("run-3")).unwrap();
    place.well(&["report", "."]);
    browser.open(&file(&place.path("report.html")), 400);
    browser.fits();
    assert_eq!(browser.value("document.querySelector('h1').textContent"), "A <b>study</b>");
    let seen =
        "[...document.querySelectorAll('tbody')[0].rows].filter((row) => row.checkVisibility()).length";
    let filter = |browser: &mut Browser, selector: &str, value: &str| {
        browser.value(&format!(
            "(() => {{ const one = document.querySelector('.filters {selector}'); one.value = '{value}'; \
             one.dispatchEvent(new Event('input', {{ bubbles: true }})); }})()"
        ));
        browser.value(seen)
    };
    assert_eq!(browser.value(seen), 12);
    assert_eq!(filter(&mut browser, "label:nth-of-type(2) select", "=cubes"), 6);
    assert_eq!(filter(&mut browser, "label:nth-of-type(3) select", "=200"), 2);
    assert_eq!(filter(&mut browser, "input", "run-10"), 1);
    assert_eq!(browser.value("document.querySelector('.filters output').textContent"), "1 of 12 rows");
    assert_eq!(browser.value("document.querySelector('td a').getAttribute('href')"), "./run-3/");
    browser.tabs_reach_all();
    browser.has_no_faults();
}

/// The address that a program with a live page prints.
fn address(from: impl Read) -> String {
    let mut line = String::new();
    BufReader::new(from).read_line(&mut line).unwrap();
    line.trim().strip_prefix("live page: ").unwrap_or_else(|| panic!("{line}")).to_string()
}

/// The first line of the answer to a request.
fn asked(address: &str, request: &str) -> String {
    let host = address.strip_prefix("http://").unwrap().split('/').next().unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    stream.write_all(request.replace("HOST", host).as_bytes()).unwrap();
    let mut answer = String::new();
    let _ = stream.read_to_string(&mut answer);
    answer.lines().next().unwrap_or_default().to_string()
}

#[test]
fn the_live_page_follows_a_run_saves_it_and_stops_it_and_the_run_can_be_resumed() {
    let Some(mut browser) = Browser::start() else { return };
    let place = Place::new(&crowd(100_000_000));
    let mut child = Guard::of(place.turbid(&["run", "case.toml", "--quiet", "--threads", "2", "--serve"]));
    let address = address(child.0.stderr.take().unwrap());
    browser.open(&address, 1600);
    let step = "Number(/step(\\d+)/.exec(document.querySelector('#facts').textContent)?.[1] ?? 0)";
    browser.wait(&format!("{step} > 8"));
    let before = browser.value(step);
    browser.wait(&format!("{step} > {before}"));
    browser.wait("document.querySelectorAll('#figures svg').length > 4");
    browser.wait("document.querySelector('#pictures img')?.naturalWidth > 100");
    browser.fits();

    // Without the token, with a wrong one, or under another name nobody is served; garbage and silence hold up nobody.
    let silent =
        TcpStream::connect(address.strip_prefix("http://").unwrap().split('/').next().unwrap()).unwrap();
    for headers in ["", "X-Turbid-Token: 0\r\n"] {
        for path in ["/stop", "/checkpoint", "/state"] {
            let said = asked(&address, &format!("POST {path} HTTP/1.1\r\nHost: HOST\r\n{headers}\r\n"));
            assert_eq!(said, "HTTP/1.1 403 Forbidden");
        }
    }
    let token = address.split('#').nth(1).unwrap();
    let foreign = format!("POST /stop HTTP/1.1\r\nHost: evil.example\r\nX-Turbid-Token: {token}\r\n\r\n");
    assert_eq!(asked(&address, &foreign), "HTTP/1.1 403 Forbidden");
    assert_eq!(asked(&address, "\u{1}\u{2}\r\n\r\n"), "HTTP/1.1 400 Bad Request");
    assert_eq!(
        asked(&address, &format!("GET /{} HTTP/1.1\r\n", "x".repeat(9000))),
        "HTTP/1.1 431 Request Header Fields Too Large"
    );
    assert!(child.0.try_wait().unwrap().is_none(), "the run continues");

    let checkpoints = || std::fs::read_dir(place.path("out/checkpoints")).map_or(0, Iterator::count);
    assert_eq!(checkpoints(), 0);
    browser.click("#checkpoint");
    poll("a checkpoint", || (checkpoints() > 0).then_some(()));
    browser.wait("/newest checkpointstep \\d+/.test(document.querySelector('#facts').textContent)");
    browser.tabs_reach_all();
    browser.open(&address, 400);
    browser.wait("document.querySelectorAll('#figures svg').length > 4");
    browser.fits();
    browser.has_no_faults();

    browser.click("#stop");
    browser.click("#yes");
    browser.wait("document.body.dataset.phase === 'stopped'");
    assert!(
        browser
            .value("document.querySelector('#phase').textContent")
            .as_str()
            .unwrap()
            .contains("turbid resume out")
    );
    child.ends_with(4);
    drop(silent);
    let done = place.summary("out")["steps"].as_u64().unwrap();
    let end = format!("run.end.steps={}", done + 4);
    place.well(&["resume", "out", "--quiet", "--set", &end]);
    assert_eq!(place.summary("out")["steps"], done + 4);
}

#[test]
fn another_process_shows_the_files_of_a_run_without_buttons() {
    let Some(mut browser) = Browser::start() else { return };
    let place = Place::new(&crowd(16));
    place.refused(&["watch", "out"], &["there is no run in out", "series.csv"]);
    place.well(&["run", "case.toml", "--quiet"]);
    let mut child = Guard::of(place.turbid(&["watch", "out"]));
    let address = address(child.0.stdout.take().unwrap());
    browser.open(&address, 1600);
    browser.wait("document.body.dataset.phase === 'complete'");
    assert_eq!(
        browser.value(
            "[document.querySelector('#bar').value, document.querySelector('#buttons').checkVisibility()]"
        ),
        json!([1, false])
    );
    assert!(
        browser
            .value("document.querySelector('#facts').textContent")
            .as_str()
            .unwrap()
            .contains("step16 of 16")
    );
    browser.wait("document.querySelector('#pictures img')?.naturalWidth > 100");
    let token = address.split('#').nth(1).unwrap();
    let stop = format!("POST /stop HTTP/1.1\r\nHost: HOST\r\nX-Turbid-Token: {token}\r\n\r\n");
    assert_eq!(asked(&address, &stop), "HTTP/1.1 404 Not Found");
    browser.has_no_faults();
}
