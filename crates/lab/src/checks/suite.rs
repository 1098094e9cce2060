//! Cases of a suite, which are run side by side: parts that need one core in parallel, longest first, then those that take all.

use super::{Ending, EngineName, Findings, Outcome};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Sender};
use std::thread;
use std::time::{Duration, Instant};
use turbid::error::{Error, Result};

/// Levels, by the time that they take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, clap::ValueEnum)]
pub enum Level {
    /// The parts that take seconds.
    Quick,
    /// All parts.
    Full,
}

/// A run of a case that needs no other.
#[derive(Debug)]
pub struct Part<C> {
    /// From which level on it is done.
    pub level: Level,
    /// About how long it takes on one core (s).
    pub seconds: f64,
    /// True if it uses all cores by itself.
    pub wide: bool,
    pub run: fn(&C, &mut Findings) -> Result<()>,
}

impl<C> Part<C> {
    pub const fn full(seconds: f64, run: fn(&C, &mut Findings) -> Result<()>) -> Self {
        Self { level: Level::Full, ..Self::quick(seconds, run) }
    }

    pub const fn wide(seconds: f64, run: fn(&C, &mut Findings) -> Result<()>) -> Self {
        Self { wide: true, ..Self::full(seconds, run) }
    }

    pub const fn quick(seconds: f64, run: fn(&C, &mut Findings) -> Result<()>) -> Self {
        Self { level: Level::Quick, seconds, wide: false, run }
    }
}

/// A case of the suite.
#[derive(Debug)]
pub struct Case<C: 'static> {
    /// Short name; of a case of the literature the folder below `validation/`.
    pub name: &'static str,
    pub question: &'static str,
    /// Sources of its references: author, year, DOI.
    pub source: &'static str,
    /// Its runs; none if it needs LIGGGHTS and this program was built without it.
    pub parts: &'static [Part<C>],
}

impl<C> Case<C> {
    /// The lowest level at which it does anything.
    pub fn level(&self) -> Level {
        let levels = self.parts.iter().map(|part| part.level);
        levels.min().unwrap_or(Level::Full)
    }

    /// About how long its parts of a level take on one core (s).
    pub fn seconds(&self, level: Level) -> f64 {
        let parts = self.parts.iter().filter(|part| part.level <= level);
        parts.map(|part| part.seconds).sum()
    }
}

/// Settings that the cases of a suite have in common.
pub trait Context: Sync + Sized {
    /// Cores to use.
    fn threads(&self) -> usize {
        1
    }

    /// Returns true if work that needs this much time must stop now.
    fn is_over(&self, _needs: Duration) -> bool {
        false
    }

    /// The engine with which cases compare the native one.
    fn engine(&self) -> Option<EngineName> {
        None
    }

    /// The reason why a case cannot be run.
    fn lacks(&self, case: &Case<Self>) -> Option<&'static str>;

    /// The results of all parts of a case, in their final form.
    fn judge(&self, case: &Case<Self>, found: Findings) -> Findings;
}

fn outcome<C: Context>(case: &Case<C>, context: &C, parts: Vec<Timed>) -> Outcome {
    let (mut seconds, mut all) = (0.0, Ok(Findings::default()));
    for (time, part) in parts {
        seconds += time;
        all = all.and_then(|mut sum: Findings| {
            sum.append(part?);
            Ok(sum)
        });
    }
    let ending = match context.lacks(case) {
        Some(why) => Ending::Missing(why.to_string()),
        None => all.map(|found| context.judge(case, found)).into(),
    };
    Outcome::new(case.name, case.question, context.engine(), seconds, ending)
}

/// Runs the parts of a level of some cases and calls `done` for each case when it has ended; all, in the order given.
pub fn run<C: Context>(
    cases: &[&'static Case<C>],
    level: Level,
    context: &C,
    mut done: impl FnMut(&Outcome),
) -> Vec<Outcome> {
    let mut outcomes: Vec<Option<Outcome>> = cases.iter().map(|_| None).collect();
    let mut end = |index: usize, found: Vec<Timed>| {
        let outcome = outcome(cases[index], context, found);
        done(&outcome);
        outcomes[index] = Some(outcome);
    };
    // Index of the case, and part.
    let mut parts: Vec<(usize, &Part<C>)> = Vec::new();
    for (index, case) in cases.iter().enumerate() {
        if context.lacks(case).is_some() {
            end(index, Vec::new());
            continue;
        }
        // A case of the full level that is asked for is run.
        let level = level.max(case.level());
        parts.extend(case.parts.iter().filter(|part| part.level <= level).map(|part| (index, part)));
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
        let started = (0..context.threads().clamp(1, narrow.len().max(1))).take_while(|_| {
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

fn timed<C: Context>(part: &Part<C>, context: &C) -> Timed {
    let start = Instant::now();
    // A part of seconds starts only if there is time for it; longer ones can be stopped.
    let needs = if part.level == Level::Quick { part.seconds } else { 0.0 };
    let over = context.is_over(Duration::from_secs_f64(needs));
    let mut found = Findings::default();
    let result = if over { Err(Error::Interrupted) } else { (part.run)(context, &mut found) };
    (start.elapsed().as_secs_f64(), result.map(|()| found))
}
