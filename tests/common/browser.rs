//! A browser without a window (Chromium), driven by its protocol for developers through two pipes.
#![allow(dead_code, reason = "each test program uses some of it")]

use super::child::{Guard, PATIENCE};
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::Instant;

/// One page of a browser.
pub(crate) struct Browser {
    to: ChildStdin,
    from: Receiver<Value>,
    number: u64,
    session: Option<String>,
    /// Errors on its console, exceptions, and resources that it could not load.
    pub(crate) faults: Vec<String>,
    _child: Guard,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// An empty page; none where no Chromium is installed, unless `TURBID_NEEDS_BROWSER` is set, as `test.sh` does.
    pub(crate) fn start() -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let answers =
            |name: &&str| Command::new(name).arg("--version").stdout(Stdio::null()).status().is_ok();
        let Some(program) = names.into_iter().find(answers) else {
            assert!(std::env::var_os("TURBID_NEEDS_BROWSER").is_none(), "no browser");
            eprintln!("skipped: there is no Chromium");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        // The browser reads commands from descriptor 3 and answers on 4.
        let mut command = Command::new("sh");
        command
            .args(["-c", "exec \"$@\" 3<&0 4>&1 </dev/null >/dev/null 2>&1", "sh", program])
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--disable-dev-shm-usage",
                "--no-first-run",
            ])
            .args(["--disable-background-networking", "--remote-debugging-pipe"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        let mut child = Guard(command.spawn().unwrap());
        let (to, output) = (child.0.stdin.take().unwrap(), child.0.stdout.take().unwrap());
        let (sender, from) = channel();
        thread::spawn(move || {
            for message in BufReader::new(output).split(0).map_while(Result::ok) {
                let _ = sender.send(serde_json::from_slice(&message).unwrap());
            }
        });
        let (number, session, faults) = (0, None, Vec::new());
        let mut browser = Self { to, from, number, session, faults, _child: child, _profile: profile };
        let page = browser.call("Target.createTarget", &json!({ "url": "about:blank" }));
        let target = json!({ "targetId": page["targetId"], "flatten": true });
        let session = browser.call("Target.attachToTarget", &target);
        browser.session = session["sessionId"].as_str().map(String::from);
        for domain in ["Page", "Runtime", "Log"] {
            browser.call(&format!("{domain}.enable"), &json!({}));
        }
        Some(browser)
    }

    /// Sends a command and waits for its result.
    pub(crate) fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.number += 1;
        let mut message = json!({ "id": self.number, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = session.as_str().into();
        }
        self.to.write_all(&[message.to_string().as_bytes(), b"\0"].concat()).unwrap();
        loop {
            let answer = self.from.recv_timeout(PATIENCE).unwrap_or_else(|error| panic!("{method}: {error}"));
            let parameters = &answer["params"];
            let is_fault = match answer["method"].as_str() {
                Some("Runtime.exceptionThrown") => true,
                Some("Log.entryAdded") => parameters["entry"]["level"] == "error",
                Some("Runtime.consoleAPICalled") => parameters["type"] == "error",
                _ => false,
            };
            if is_fault {
                self.faults.push(parameters.to_string());
            }
            if answer["id"] == self.number {
                assert!(answer["error"].is_null(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// Opens an address in a window of this width (pixels) and waits until it is there.
    pub(crate) fn open(&mut self, address: &str, width: u32) {
        let size = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &size);
        self.call("Page.navigate", &json!({ "url": "about:blank" }));
        self.call("Page.navigate", &json!({ "url": address }));
        self.wait("document.readyState === 'complete' && location.href !== 'about:blank'");
    }

    /// The value of an expression on the page.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", &parameters);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression holds.
    pub(crate) fn wait(&mut self, expression: &str) {
        let start = Instant::now();
        while self.value(expression) != true {
            assert!(start.elapsed() < PATIENCE, "waited in vain for {expression}");
            self.value("new Promise(requestAnimationFrame)");
        }
    }

    /// Moves the mouse over an element, to parts of its width and height, and clicks there.
    pub(crate) fn mouse(&mut self, selector: &str, [x, y]: [f64; 2], click: bool) {
        let selector = json!(selector);
        let at = self.value(&format!(
            "(() => {{ const one = document.querySelector({selector}); one.scrollIntoView({{ block: 'center' }}); \
             const box = one.getBoundingClientRect(); \
             return [box.left + {x} * box.width, box.top + {y} * box.height]; }})()"
        ));
        let kinds: &[&str] =
            if click { &["mouseMoved", "mousePressed", "mouseReleased"] } else { &["mouseMoved"] };
        for kind in kinds {
            let button = if *kind == "mouseMoved" { "none" } else { "left" };
            let event = json!({ "type": kind, "x": at[0], "y": at[1], "button": button, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", &event);
        }
    }

    pub(crate) fn click(&mut self, selector: &str) {
        self.mouse(selector, [0.5, 0.5], true);
    }

    /// Presses a key: `"Tab"`, `"Enter"`, `"ArrowLeft"`.
    pub(crate) fn key(&mut self, key: &str) {
        let (code, text) = match key {
            "Tab" => (9, None),
            "Enter" => (13, Some("\r")),
            "ArrowLeft" => (37, None),
            "ArrowRight" => (39, None),
            other => panic!("unknown key {other}"),
        };
        for kind in [if text.is_some() { "keyDown" } else { "rawKeyDown" }, "keyUp"] {
            let mut event = json!({ "type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code });
            if let Some(text) = text {
                event["text"] = text.into();
            }
            self.call("Input.dispatchKeyEvent", &event);
        }
    }

    /// Nothing on the page may be wider than the window.
    #[track_caller]
    pub(crate) fn fits(&mut self) {
        let widths = self.value("[document.documentElement.scrollWidth, innerWidth]");
        assert!(widths[0].as_f64() <= widths[1].as_f64(), "{widths}");
    }

    /// Every control that is to be seen gets the focus in a round with the tabulator key.
    pub(crate) fn tabs_reach_all(&mut self) {
        // By what they say, as a live page makes some of them anew.
        let name = "((one) => one.tagName + (one.ariaLabel || one.textContent.trim() || one.id))";
        let all = "[...document.querySelectorAll('a[href], button, input, select, [tabindex=\"0\"]')]\
                   .filter((one) => one.checkVisibility() && !one.disabled)";
        self.value("document.activeElement.blur(); scrollTo(0, 0)");
        let count =
            self.value(&format!("(window.unreached = new Set({all}.map({name}))).size")).as_u64().unwrap();
        assert!(count > 3, "{count} controls");
        let stops = self.value(&format!("{all}.length")).as_u64().unwrap();
        for _ in 0..=stops + 5 {
            self.key("Tab");
            self.value(&format!("void window.unreached.delete({name}(document.activeElement))"));
        }
        assert_eq!(self.value("[...window.unreached]"), json!([]));
    }

    #[track_caller]
    pub(crate) fn has_no_faults(&self) {
        assert!(self.faults.is_empty(), "{:#?}", self.faults);
    }
}
