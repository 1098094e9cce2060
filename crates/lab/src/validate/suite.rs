//! Runs cases side by side: parts that need one core in parallel, longest first, then those that take all.

use super::{Case, Findings, Level, Part, SuiteContext};
use crate::checks::{Check, Ending, Outcome};
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::{Duration, Instant};
use turbid::error::{Error, Result};
use turbid::output::numbers::duration;

/// Reason why a case has no parts.
const MISSING: &str = "built without LIGGGHTS; `cargo build --release --features liggghts` has it";

/// The cases: level, time, question and source of each; then the time of each level.
pub fn list(cases: &[Case]) -> String {
    let width = cases.iter().map(|case| case.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for case in cases {
        let [quick, full] = [Level::Quick, Level::Full].map(|level| case.seconds(level));
        let times = match case.level() {
            Level::Quick if full > quick => format!("quick, {}; full, {}", duration(quick), duration(full)),
            Level::Quick => format!("quick, {}", duration(quick)),
            Level::Full => format!("full, {}", duration(full)),
        };
        let _ = writeln!(text, "  {:width$}  {} ({times})", case.name, case.question);
        let _ = writeln!(text, "  {:width$}  {}", "", case.source);
        if case.parts.is_empty() {
            let _ = writeln!(text, "  {:width$}  not here: {MISSING}", "");
        }
    }
    let all = |level| duration(cases.iter().map(|case| case.seconds(level)).sum());
    let [quick, full] = [Level::Quick, Level::Full].map(all);
    let _ = writeln!(text, "times are of one core; together: quick, {quick}; full, {full}");
    text
}

/// Puts the parts of a case together, in their order.
fn outcome(case: &Case, parts: Vec<Timed>) -> Outcome {
    let (mut seconds, mut all) = (0.0, Ok(Findings::default()));
    for (time, part) in parts {
        seconds += time;
        all = all.and_then(|mut sum: Findings| {
            sum.append(part?);
            Ok(sum)
        });
    }
    for check in all.iter_mut().flat_map(|found| &mut found.checks) {
        if check.source.is_empty() {
            check.source = case.source.to_string();
        }
    }
    if let Ok(found) = &mut all {
        found.notes.extend(biases(&found.checks));
    }
    let ending = if case.parts.is_empty() { Ending::Missing(MISSING.to_string()) } else { all.into() };
    Outcome::new(case.name, case.question, None, seconds, ending)
}

/// Mean signed deviations of the quantities that were checked at three points or more; a quantity is called the same up to the
/// first comma of its name.
fn biases(checks: &[Check]) -> Vec<(String, f64)> {
    let name = |check: &Check| check.quantity.split([',', '(']).next().unwrap_or_default().to_string();
    let mut groups: Vec<(String, Vec<Check>)> = Vec::new();
    for check in checks.iter().filter(|check| check.reference != 0.0) {
        match groups.iter_mut().find(|(known, _)| *known == name(check)) {
            Some((_, group)) => group.push(check.clone()),
            None => groups.push((name(check), vec![check.clone()])),
        }
    }
    let groups = groups.iter().filter(|(_, group)| group.len() > 2);
    let biases = groups.filter_map(|(name, group)| Check::bias(name.trim(), group, true));
    biases.map(|bias| (bias.quantity, bias.measured)).collect()
}

/// Runs the parts of a level of some cases and calls `done` for each case when it has ended; all, in the order given.
pub fn run(
    cases: &[&'static Case],
    level: Level,
    context: &SuiteContext,
    mut done: impl FnMut(&Outcome),
) -> Vec<Outcome> {
    let mut outcomes: Vec<Option<Outcome>> = cases.iter().map(|_| None).collect();
    let mut end = |index: usize, found: Vec<Timed>| {
        let outcome = outcome(cases[index], found);
        done(&outcome);
        outcomes[index] = Some(outcome);
    };
    // Index of the case, and part.
    let mut parts: Vec<(usize, &Part)> = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        // A case of the full level that is asked for is run.
        let level = level.max(case.level());
        parts.extend(case.parts.iter().filter(|part| part.level <= level).map(|part| (index, part)));
        if case.parts.is_empty() {
            end(index, Vec::new());
        }
    }
    let mut results: Vec<Option<Timed>> = parts.iter().map(|_| None).collect();
    let mut take = |at: usize, result: Timed| {
        results[at] = Some(result);
        let index = parts[at].0;
        let of_case = || (0..parts.len()).filter(|&k| parts[k].0 == index);
        if of_case().all(|k| results[k].is_some()) {
            end(index, of_case().filter_map(|k| results[k].take()).collect());
        }
    };
    let (wide, mut narrow): (Vec<usize>, Vec<usize>) = (0..parts.len()).partition(|&at| parts[at].1.wide);
    narrow.sort_by(|&a, &b| parts[b].1.seconds.total_cmp(&parts[a].1.seconds));
    let (next, (sender, receiver)) = (AtomicUsize::new(0), mpsc::channel());
    let work = |sender: Sender<_>| {
        while let Some(&at) = narrow.get(next.fetch_add(1, Ordering::Relaxed)) {
            // Nobody listens any more only if the other end has panicked.
            let _ = sender.send((at, timed(parts[at].1, context)));
        }
    };
    thread::scope(|scope| {
        // At most this many; without any, this thread does the work, which otherwise only listens.
        let started = (0..context.threads.clamp(1, narrow.len().max(1))).take_while(|_| {
            let (sender, work) = (sender.clone(), &work);
            thread::Builder::new().spawn_scoped(scope, move || work(sender)).is_ok()
        });
        if started.count() == 0 {
            work(sender.clone());
        }
        drop(sender);
        for (at, result) in receiver {
            take(at, result);
        }
    });
    for at in wide {
        take(at, timed(parts[at].1, context));
    }
    outcomes.into_iter().flatten().collect()
}

/// Seconds, and findings of a part.
type Timed = (f64, Result<Findings>);

fn timed(part: &Part, context: &SuiteContext) -> Timed {
    let start = Instant::now();
    // A part of seconds starts only if there is time for it; longer ones can be stopped.
    let needs = if part.level == Level::Quick { part.seconds } else { 0.0 };
    let over = context.is_over(Duration::from_secs_f64(needs));
    let result = if over { Err(Error::Interrupted) } else { (part.run)(context) };
    (start.elapsed().as_secs_f64(), result)
}
