//! What a person sees while a command runs: log lines, and progress with rate and time left.

use indicatif::{
    HumanFloatCount, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tracing::{Level, info};
use tracing_subscriber::fmt::MakeWriter;

/// Without a terminal, long work says how far it is about this often.
const LOG_EVERY: Duration = Duration::from_secs(15);

static BARS: OnceLock<Option<MultiProgress>> = OnceLock::new();

/// Starts logging to standard error: `-v` details, `-q` warnings only. Progress bars are drawn if that is a terminal.
pub(crate) fn start(verbose: bool, quiet: bool) {
    let level = match (verbose, quiet) {
        (true, _) => Level::DEBUG,
        (_, true) => Level::WARN,
        _ => Level::INFO,
    };
    let terminal = io::stderr().is_terminal();
    let bars = (terminal && !quiet).then(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr()));
    let _ = BARS.set(bars);
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .without_time()
        .with_ansi(terminal)
        .log_internal_errors(false)
        .with_writer(AboveBars)
        .init();
}

/// Writes log lines to standard error, above any progress bar that is drawn there.
struct AboveBars;

impl MakeWriter<'_> for AboveBars {
    type Writer = LineAboveBars;

    fn make_writer(&self) -> LineAboveBars {
        LineAboveBars
    }
}

struct LineAboveBars;

impl Write for LineAboveBars {
    /// Never fails: that nobody reads the log any more is no reason to end hours of work.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let _ = match BARS.get() {
            Some(Some(bars)) => bars.suspend(|| io::stderr().write_all(line)),
            _ => io::stderr().write_all(line),
        };
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = io::stderr().flush();
        Ok(())
    }
}

/// The progress of one piece of long work: a bar on a terminal, a log line now and then elsewhere.
pub(crate) struct Progress {
    what: &'static str,
    unit: &'static str,
    total: u64,
    bar: Option<ProgressBar>,
    started: Instant,
    state: Mutex<State>,
}

struct State {
    done: u64,
    said: Instant,
}

impl Progress {
    /// Begins `total` units of work, named by what is done ("rendering") to what ("images").
    pub(crate) fn new(what: &'static str, unit: &'static str, total: u64) -> Self {
        let bar = BARS.get().and_then(Option::as_ref).map(|bars| {
            let bar = bars.add(ProgressBar::new(total));
            let template = "{prefix:>12} [{bar:40}] {human_pos}/{human_len} {msg}, {rate}, {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                let rate = |state: &ProgressState, out: &mut dyn fmt::Write| {
                    let _ = write!(out, "{}/s", HumanFloatCount(round_rate(state.per_sec())));
                };
                bar.set_style(style.with_key("rate", rate).progress_chars("=> "));
            }
            bar.set_prefix(what);
            bar.set_message(unit);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        let now = Instant::now();
        Self { what, unit, total, bar, started: now, state: Mutex::new(State { done: 0, said: now }) }
    }

    /// `n` more units are done.
    pub(crate) fn add(&self, n: u64) {
        if let Some(bar) = &self.bar {
            return bar.inc(n);
        }
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.done += n;
        if state.said.elapsed() >= LOG_EVERY && state.done < self.total {
            state.said = Instant::now();
            let rate = state.done as f64 / self.started.elapsed().as_secs_f64();
            let left = (self.total - state.done) as f64 / rate;
            info!("{} {}/{} {}, {rate:.1}/s, {left:.0} s left", self.what, state.done, self.total, self.unit);
        }
    }
}

/// Rates below 10 with one digit behind the point, others whole.
fn round_rate(rate: f64) -> f64 {
    if rate < 10.0 { (10.0 * rate).round() / 10.0 } else { rate.round() }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
