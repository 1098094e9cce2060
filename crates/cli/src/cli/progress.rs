//! Progress of a run on standard error: a bar on a terminal, otherwise a plain line every few seconds.

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::{IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use turbid::case::Setup;
use turbid::simulation::Progress;

/// Shows the run at hand; quiet, only its warnings.
pub(super) struct Terminal {
    quiet: bool,
    display: Mutex<Option<Display>>,
}

impl Terminal {
    pub(super) fn new(quiet: bool) -> Self {
        Self { quiet, display: Mutex::new(None) }
    }

    fn display(&self) -> MutexGuard<'_, Option<Display>> {
        self.display.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes away what is shown of a run that has failed.
    pub(super) fn clear(&self) {
        *self.display() = None;
    }
}

impl Progress for Terminal {
    fn start(&self, setup: &Setup, first: u64) {
        *self.display() = (!self.quiet).then(|| Display::new(Workload::of(setup, first)));
    }

    fn step(&self, step: u64) {
        if let Some(display) = &mut *self.display() {
            display.update(step, Instant::now());
        }
    }

    fn warn(&self, text: &str) {
        let text = format!("warning: {text}");
        match &mut *self.display() {
            Some(display) => display.note(&text),
            None => drop(writeln!(std::io::stderr(), "{text}")),
        }
    }

    fn finish(&self, step: u64) {
        if let Some(mut display) = self.display().take() {
            display.finish(step, Instant::now());
        }
    }
}

/// Size of a run.
#[derive(Clone, Copy)]
pub(super) struct Workload {
    /// Steps of the whole run, those before `first` included.
    pub(super) steps: u64,
    /// Steps done before.
    pub(super) first: u64,
    /// Number of cells; 0 without a fluid, where the speed is in steps.
    pub(super) cells: usize,
    /// Time step (s).
    pub(super) time_step: f64,
    /// Unit of `t*` (s); without, times are in seconds.
    pub(super) stokes_time: Option<f64>,
}

impl Workload {
    /// Of a run that begins after `first` steps.
    pub(super) fn of(setup: &Setup, first: u64) -> Self {
        Self {
            steps: setup.plan.end_step,
            first,
            cells: setup.fluid_cells(),
            time_step: setup.time_step,
            stokes_time: setup.stokes_time(),
        }
    }

    /// Time after `step` steps, with its name before and its unit behind it.
    fn time(&self, step: u64) -> (&'static str, String, &'static str) {
        let time = step as f64 * self.time_step;
        match self.stokes_time {
            Some(unit) => ("t*", format!("{:.1}", time / unit), ""),
            None => ("t", format!("{time:.3}"), " s"),
        }
    }

    /// Speed at `rate` steps per second.
    fn speed(&self, rate: f64) -> String {
        if self.cells > 0 {
            format!("{:.1} MLUPS", rate * self.cells as f64 * 1e-6)
        } else {
            format!("{rate:.0} steps/s")
        }
    }
}

/// Speed of a run.
pub(super) struct Pace {
    pub(super) work: Workload,
    interval: Duration,
    shown: Instant,
    shown_step: u64,
    /// Steps per second, smoothed over the last few updates.
    rate: f64,
}

/// Progress of a run.
struct Display {
    pace: Pace,
    target: Target,
    start: Instant,
}

enum Target {
    Bar(ProgressBar),
    Lines(Box<dyn Write + Send>),
}

/// Time between updates of the bar.
const BAR_INTERVAL: Duration = Duration::from_millis(200);
/// Time between plain lines.
pub(super) const LINE_INTERVAL: Duration = Duration::from_secs(5);
/// Weight of the newest rate: the estimate follows a change within a few updates and does not flicker.
const NEW_WEIGHT: f64 = 0.3;

impl Display {
    fn new(work: Workload) -> Self {
        let (target, interval) = if std::io::stderr().is_terminal() {
            let bar = ProgressBar::with_draw_target(Some(work.steps), ProgressDrawTarget::stderr());
            (Target::Bar(bar.with_style(bar_style())), BAR_INTERVAL)
        } else {
            (Target::Lines(Box::new(std::io::stderr())), LINE_INTERVAL)
        };
        Self::with_target(work, target, interval, Instant::now())
    }

    fn with_target(work: Workload, target: Target, interval: Duration, start: Instant) -> Self {
        Self { pace: Pace::new(work, interval, start), target, start }
    }

    /// Shows that `step` steps are done, if it is time to.
    fn update(&mut self, step: u64, now: Instant) {
        if !self.pace.update(step, now) {
            return;
        }
        let Progressed { time, speed, left } = self.pace.status(step);
        let text = format!("{time}  {speed}  ETA {left}");
        match &mut self.target {
            Target::Bar(bar) => {
                bar.set_message(text);
                bar.set_position(step);
            }
            Target::Lines(out) => {
                let percent = 100.0 * step as f64 / self.pace.work.steps.max(1) as f64;
                // Progress that cannot be shown is no reason to end a run.
                let _ = writeln!(out, "{percent:5.1}%  {text}");
            }
        }
    }

    /// Prints a line without disturbing the bar.
    fn note(&mut self, text: &str) {
        match &mut self.target {
            Target::Bar(bar) => bar.println(text),
            Target::Lines(out) => drop(writeln!(out, "{text}")),
        }
    }

    /// Ends the display after `step` steps with their average speed.
    fn finish(&mut self, step: u64, now: Instant) {
        let seconds = now.duration_since(self.start).as_secs_f64();
        let work = self.pace.work;
        let (name, time, unit) = work.time(step);
        let done = step.saturating_sub(work.first);
        let text = format!(
            "{done} steps in {}, {name} {time}{unit}, {}",
            clock(seconds),
            work.speed(done as f64 / seconds.max(1e-9))
        );
        if let Target::Bar(bar) = &self.target {
            bar.finish_and_clear();
            // After the bar is gone this is an ordinary line.
            self.target = Target::Lines(Box::new(std::io::stderr()));
        }
        self.note(&text);
    }
}

/// Numbers of a run that is under way.
pub(super) struct Progressed {
    /// Time in the simulation, and that at its end.
    pub(super) time: String,
    pub(super) speed: String,
    /// Time that the rest takes.
    pub(super) left: String,
}

impl Pace {
    /// That is measured over at least `interval`.
    pub(super) fn new(work: Workload, interval: Duration, start: Instant) -> Self {
        Self { work, interval, shown: start, shown_step: work.first, rate: 0.0 }
    }

    /// Takes note that `step` steps are done, if it is time to; returns whether it was.
    pub(super) fn update(&mut self, step: u64, now: Instant) -> bool {
        let elapsed = now.duration_since(self.shown);
        if elapsed < self.interval {
            return false;
        }
        let rate = step.saturating_sub(self.shown_step) as f64 / elapsed.as_secs_f64();
        self.rate = if self.shown_step == self.work.first {
            rate
        } else {
            NEW_WEIGHT * rate + (1.0 - NEW_WEIGHT) * self.rate
        };
        (self.shown, self.shown_step) = (now, step);
        true
    }

    /// After `step` steps.
    pub(super) fn status(&self, step: u64) -> Progressed {
        let left = if self.rate > 0.0 {
            clock(self.work.steps.saturating_sub(step) as f64 / self.rate)
        } else {
            "?".to_string()
        };
        let (name, now, unit) = self.work.time(step);
        let (_, end, _) = self.work.time(self.work.steps);
        Progressed { time: format!("{name} {now} of {end}{unit}"), speed: self.work.speed(self.rate), left }
    }
}

fn bar_style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:32.cyan/black.bright} {percent:>3}%  {msg}")
        .expect("the template is a constant")
        .progress_chars("\u{2501}\u{2578}\u{2501}")
}

/// `h:mm:ss`, or `m:ss` below an hour.
fn clock(seconds: f64) -> String {
    let s = seconds.round() as u64;
    let (hours, minutes, seconds) = (s / 3600, s / 60 % 60, s % 60);
    if hours > 0 { format!("{hours}:{minutes:02}:{seconds:02}") } else { format!("{minutes}:{seconds:02}") }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Arc, Mutex};

    #[derive(Clone, Default)]
    struct Sink(Arc<Mutex<Vec<u8>>>);

    impl Write for Sink {
        fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
            self.0.lock().unwrap().write(bytes)
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }

    const WORK: Workload =
        Workload { steps: 1000, first: 0, cells: 2_000_000, time_step: 1e-4, stokes_time: Some(2e-3) };

    #[test]
    fn without_a_fluid_time_is_in_seconds_and_speed_in_steps() {
        let dry = Workload { cells: 0, stokes_time: None, ..WORK };
        let mut progress =
            Display::with_target(dry, Target::Lines(Box::new(Sink::default())), BAR_INTERVAL, Instant::now());
        progress.pace.rate = 100.0;
        let Progressed { time, speed, left } = progress.pace.status(500);
        assert_eq!([&*time, &*speed, &*left], ["t 0.050 of 0.100 s", "100 steps/s", "0:05"]);
    }

    #[test]
    fn lines_come_at_intervals_with_rate_and_remaining_time() {
        let sink = Sink::default();
        let start = Instant::now();
        let mut progress =
            Display::with_target(WORK, Target::Lines(Box::new(sink.clone())), Duration::from_secs(5), start);
        // Ten steps a second, told after every step.
        for step in 1..=110 {
            progress.update(step, start + Duration::from_millis(100 * step));
        }
        progress.finish(110, start + Duration::from_secs(11));
        let text = String::from_utf8(sink.0.lock().unwrap().clone()).unwrap();
        assert_eq!(
            text.lines().collect::<Vec<_>>(),
            [
                "  5.0%  t* 2.5 of 50.0  20.0 MLUPS  ETA 1:35",
                " 10.0%  t* 5.0 of 50.0  20.0 MLUPS  ETA 1:30",
                "110 steps in 0:11, t* 5.5, 20.0 MLUPS",
            ]
        );
    }

    #[test]
    fn the_remaining_time_is_that_of_the_measured_speed_from_the_first_seconds_on_and_follows_it() {
        let start = Instant::now();
        let resumed = Workload { first: 200, ..WORK };
        let mut pace = Pace::new(resumed, LINE_INTERVAL, start);
        let mut left = |step, seconds| {
            pace.update(step, start + Duration::from_secs(seconds));
            pace.status(step).left
        };
        // 10 steps a second, then 5.
        assert_eq!(left(250, 5), "1:15");
        let later: Vec<String> = (2..=12).map(|n| left(225 + 25 * n, 5 * n)).collect();
        assert_eq!(later[0], "1:25");
        // Exactly 1:35.
        assert_eq!(later[10], "1:33");
    }

    #[test]
    fn a_bar_shows_the_same_words_as_the_lines_and_ends() {
        let bar = ProgressBar::with_draw_target(Some(WORK.steps), ProgressDrawTarget::hidden());
        let target = Target::Bar(bar.clone().with_style(bar_style()));
        let start = Instant::now();
        let mut progress = Display::with_target(WORK, target, BAR_INTERVAL, start);
        progress.update(50, start + Duration::from_secs(5));
        assert_eq!(bar.message(), "t* 2.5 of 50.0  20.0 MLUPS  ETA 1:35");
        assert_eq!(bar.position(), 50);
        progress.finish(1000, start + Duration::from_secs(100));
        assert!(bar.is_finished());
    }

    #[test]
    fn long_times_show_hours() {
        assert_eq!(clock(59.6), "1:00");
        assert_eq!(clock(3.0 * 3600.0 + 62.0), "3:01:02");
    }
}
