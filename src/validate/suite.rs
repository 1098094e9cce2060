//! Runs cases side by side: parts that need one core in parallel, longest first, then those that take all.

use super::{Case, Findings, Level, Part, Trial};
use crate::error::{Error, Result};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::{Duration, Instant};

/// A case after its run.
#[derive(Debug)]
pub struct Outcome {
    /// The case.
    pub case: &'static Case,
    /// How long its parts took, one after another (s).
    pub seconds: f64,
    /// What it found, or why it did not come to its end; `None` if this program cannot run it.
    pub result: Option<Result<Findings>>,
}

impl Outcome {
    /// Puts the parts of a case together, in their order. A case that checks nothing has failed.
    fn of(case: &'static Case, parts: Vec<(f64, Result<Findings>)>) -> Self {
        let seconds = parts.iter().map(|(seconds, _)| seconds).sum();
        let mut all = Ok(Findings::default());
        for (_, part) in parts {
            all = match (all, part) {
                (Ok(mut sum), Ok(found)) => {
                    sum.append(found);
                    Ok(sum)
                }
                (Err(first), _) | (Ok(_), Err(first)) => Err(first),
            };
        }
        let result = match all {
            Ok(found) if found.checks.is_empty() => Err(Error::Input("the case checked nothing".to_string())),
            result => result,
        };
        Self {
            case,
            seconds,
            result: Some(result),
        }
    }
}

/// How the checks of all cases came out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Score {
    /// Checks that passed.
    pub passed: usize,
    /// All checks; a case that did not come to its end counts as one.
    pub checks: usize,
    /// Cases that this program cannot run.
    pub missing: usize,
    /// Cases that were stopped.
    pub interrupted: usize,
}

impl Score {
    /// Counts the checks of all cases.
    pub fn of(outcomes: &[Outcome]) -> Self {
        let mut score = Self::default();
        for outcome in outcomes {
            match &outcome.result {
                Some(Ok(found)) => {
                    score.checks += found.checks.len();
                    score.passed += found.checks.iter().filter(|check| check.pass).count();
                }
                Some(Err(Error::Interrupted)) => score.interrupted += 1,
                Some(Err(_)) => score.checks += 1,
                None => score.missing += 1,
            }
        }
        score
    }

    /// Whether every check passed.
    pub fn is_full(&self) -> bool {
        self.passed == self.checks
    }
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
            let outcome = Outcome {
                case,
                seconds: 0.0,
                result: None,
            };
            done(&outcome);
            state.outcomes[index] = Some(outcome);
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
    let needs = if part.level == Level::Quick {
        part.seconds
    } else {
        0.0
    };
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
        let (case, parts) = &mut self.cases[index];
        parts[place] = Some(found);
        if parts.iter().all(Option::is_some) {
            let outcome = Outcome::of(case, std::mem::take(parts).into_iter().flatten().collect());
            done(&outcome);
            self.outcomes[index] = Some(outcome);
        }
    }
}
