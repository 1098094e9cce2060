//! Runs cases side by side: parts that need one core in parallel, longest first, then those that take all.

use super::{Case, Findings, Level, Part, Trial};
use crate::checks::{Check, Ending, Outcome};
use std::fmt::Write;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::{Duration, Instant};
use turbid::error::{Error, Result};
use turbid::output::numbers::duration;

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
        if let Some(why) = case.missing {
            let _ = writeln!(text, "  {:width$}  not here: {why}", "");
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
    let ending = case.missing.map_or_else(|| all.into(), Ending::Missing);
    Outcome::new(case.name, case.question, false, seconds, ending)
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
    trial: &Trial,
    mut done: impl FnMut(&Outcome),
) -> Vec<Outcome> {
    let chosen = |case: &Case| -> Vec<Part> {
        // A case of the full level that is asked for is run.
        let level = level.max(case.level());
        let parts = case.parts.iter().filter(|part| part.level <= level);
        parts.copied().collect()
    };
    let mut state = Gathered {
        cases: cases.iter().map(|case| (*case, Vec::new())).collect(),
        outcomes: cases.iter().map(|_| None).collect(),
    };
    let (mut narrow, mut wide) = (Vec::new(), Vec::new());
    for (index, case) in cases.iter().enumerate() {
        if case.missing.is_some() {
            state.end(index, &mut done);
            continue;
        }
        for (place, part) in chosen(case).into_iter().enumerate() {
            state.cases[index].1.push(None);
            if part.wide { &mut wide } else { &mut narrow }.push((index, place, part));
        }
    }
    narrow.sort_by(|a, b| b.2.seconds.total_cmp(&a.2.seconds));
    let (next, (sender, receiver)) = (AtomicUsize::new(0), mpsc::channel());
    let work = |sender: Sender<_>| {
        while let Some((index, place, part)) = narrow.get(next.fetch_add(1, Ordering::Relaxed)) {
            // Nobody listens any more only if the other end has panicked.
            let _ = sender.send((*index, *place, timed(part, trial)));
        }
    };
    thread::scope(|scope| {
        // As many as can be had; the last one is this thread, which otherwise only listens.
        let started = (0..trial.threads.clamp(1, narrow.len().max(1))).take_while(|_| {
            let (sender, work) = (sender.clone(), &work);
            let thread = thread::Builder::new().spawn_scoped(scope, move || work(sender));
            thread.is_ok()
        });
        if started.count() == 0 {
            work(sender.clone());
        }
        drop(sender);
        for (index, place, found) in receiver {
            state.take(index, place, found, &mut done);
        }
    });
    for (index, place, part) in &wide {
        state.take(*index, *place, timed(part, trial), &mut done);
    }
    state.outcomes.into_iter().flatten().collect()
}

type Timed = (f64, Result<Findings>);

fn timed(part: &Part, trial: &Trial) -> Timed {
    let start = Instant::now();
    // What takes seconds is begun only if there is time for it; the rest sees for itself.
    let needs = if part.level == Level::Quick { part.seconds } else { 0.0 };
    let result = if trial.is_over(Duration::from_secs_f64(needs)) {
        Err(Error::Interrupted)
    } else {
        (part.run)(trial)
    };
    (start.elapsed().as_secs_f64(), result)
}

/// What has been found so far.
struct Gathered {
    cases: Vec<(&'static Case, Vec<Option<Timed>>)>,
    outcomes: Vec<Option<Outcome>>,
}

impl Gathered {
    fn take(&mut self, index: usize, place: usize, found: Timed, done: &mut impl FnMut(&Outcome)) {
        let parts = &mut self.cases[index].1;
        parts[place] = Some(found);
        if parts.iter().all(Option::is_some) {
            self.end(index, done);
        }
    }

    fn end(&mut self, index: usize, done: &mut impl FnMut(&Outcome)) {
        let (case, parts) = &mut self.cases[index];
        let outcome = outcome(case, std::mem::take(parts).into_iter().flatten().collect());
        done(&outcome);
        self.outcomes[index] = Some(outcome);
    }
}
