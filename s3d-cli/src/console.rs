//! What is written to standard error while a command runs: log lines, and progress with rate and time left; for a person,
//! or as a JSON object a line.

use crate::event::{Event, emit};
use clap::ValueEnum;
use indicatif::{
    HumanFloatCount, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};
use serde::Serialize;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::{Level, Metadata, Subscriber, info};
use tracing_subscriber::fmt::format::{FormatEvent, FormatFields, Writer};
use tracing_subscriber::fmt::{FmtContext, MakeWriter};
use tracing_subscriber::registry::LookupSpan;

/// Without a terminal, long work says how far it is about this often.
const LOG_EVERY: Duration = Duration::from_secs(15);

/// The same in JSON.
const EVENT_EVERY: Duration = Duration::from_secs(3);

static CONSOLE: OnceLock<Console> = OnceLock::new();
static WARNINGS: AtomicU64 = AtomicU64::new(0);

/// For whom standard error is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// For a person.
    #[default]
    Text,
    /// For a program: one JSON object a line, see docs/log.md.
    Json,
}

struct Console {
    json: bool,
    quiet: bool,
    bars: Option<MultiProgress>,
    started: Instant,
}

/// Starts logging to standard error: `-v` details, `-q` warnings only. Progress bars are drawn if that is a terminal and
/// the log is for a person.
pub(crate) fn start(verbose: bool, quiet: bool, format: LogFormat) {
    let level = match (verbose, quiet) {
        (true, _) => Level::DEBUG,
        (_, true) => Level::WARN,
        _ => Level::INFO,
    };
    let json = format == LogFormat::Json;
    let terminal = io::stderr().is_terminal() && !json;
    let bars = (terminal && !quiet).then(|| MultiProgress::with_draw_target(ProgressDrawTarget::stderr()));
    let _ = CONSOLE.set(Console { json, quiet, bars, started: Instant::now() });
    let log = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_target(false)
        .without_time()
        .with_ansi(terminal)
        .log_internal_errors(false)
        .with_writer(AboveBars);
    if json { log.event_format(JsonLines).init() } else { log.init() }
}

/// How many warnings there were so far.
pub(crate) fn warnings() -> u64 {
    WARNINGS.load(Ordering::Relaxed)
}

/// Whether standard error is for a program.
pub(crate) fn is_json() -> bool {
    CONSOLE.get().is_some_and(|c| c.json)
}

/// Takes away what bars are drawn.
pub(crate) fn clear() {
    if let Some(bars) = bars() {
        let _ = bars.clear();
    }
}

fn bars() -> Option<&'static MultiProgress> {
    CONSOLE.get()?.bars.as_ref()
}

/// An event as a line on standard error; those of work under way only if the caller did not ask for quiet.
pub(crate) fn write_json(event: &Event<'_>) {
    let essential = matches!(event, Event::Log { .. } | Event::Summary(_) | Event::Finished { .. });
    if essential || !CONSOLE.get().is_some_and(|c| c.quiet) {
        let _ = LineAboveBars.write(json_line(event).as_bytes());
    }
}

/// The event with the time of the process, and the end of the line.
fn json_line(event: &Event<'_>) -> String {
    #[derive(Serialize)]
    struct Line<'a> {
        #[serde(flatten)]
        event: &'a Event<'a>,
        at_seconds: f64,
    }
    let at_seconds = CONSOLE.get().map_or(0.0, |c| c.started.elapsed().as_secs_f64());
    // Nothing in an event can fail to be JSON: keys are texts, and numbers that are none become null.
    let mut line = serde_json::to_string(&Line { event, at_seconds: thousandths(at_seconds) })
        .unwrap_or_else(|_| String::from("{\"event\":\"unknown\"}"));
    line.push('\n');
    line
}

/// A number of seconds, rounded to what is worth telling.
pub(crate) fn thousandths(seconds: f64) -> f64 {
    (1000.0 * seconds).round() / 1000.0
}

/// Log lines as events.
struct JsonLines;

impl<S, N> FormatEvent<S, N> for JsonLines
where
    S: Subscriber + for<'a> LookupSpan<'a>,
    N: for<'a> FormatFields<'a> + 'static,
{
    fn format_event(
        &self,
        _: &FmtContext<'_, S, N>,
        mut writer: Writer<'_>,
        event: &tracing::Event<'_>,
    ) -> fmt::Result {
        let mut message = Message(String::new());
        event.record(&mut message);
        let level = match *event.metadata().level() {
            Level::ERROR => "error",
            Level::WARN => "warning",
            Level::INFO => "info",
            _ => "debug",
        };
        writer.write_str(&json_line(&Event::Log { level, message: &message.0 }))
    }
}

/// The text of a log line.
struct Message(String);

impl Visit for Message {
    fn record_debug(&mut self, field: &Field, value: &dyn fmt::Debug) {
        if field.name() == "message" {
            self.0 = format!("{value:?}");
        }
    }
}

/// Writes log lines to standard error, above any progress bar that is drawn there, and counts the warnings.
struct AboveBars;

impl MakeWriter<'_> for AboveBars {
    type Writer = LineAboveBars;

    fn make_writer(&self) -> LineAboveBars {
        LineAboveBars
    }

    fn make_writer_for(&self, metadata: &Metadata<'_>) -> LineAboveBars {
        if *metadata.level() == Level::WARN {
            WARNINGS.fetch_add(1, Ordering::Relaxed);
        }
        LineAboveBars
    }
}

struct LineAboveBars;

impl Write for LineAboveBars {
    /// Never fails: that nobody reads the log any more is no reason to end hours of work.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let _ = match bars() {
            Some(bars) => bars.suspend(|| io::stderr().write_all(line)),
            None => io::stderr().write_all(line),
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
        let bar = bars().map(|bars| {
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
        let json = is_json();
        let ended = state.done >= self.total;
        let due = state.said.elapsed() >= if json { EVENT_EVERY } else { LOG_EVERY };
        if if json { due || ended } else { due && !ended } {
            state.said = Instant::now();
            let rate = state.done as f64 / self.started.elapsed().as_secs_f64();
            let left = self.total.saturating_sub(state.done) as f64 / rate;
            if json {
                emit(&Event::Progress {
                    what: self.what,
                    unit: self.unit,
                    done: state.done,
                    total: self.total,
                    rate: thousandths(rate),
                    seconds_left: left.is_finite().then(|| thousandths(left)),
                });
                return;
            }
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
