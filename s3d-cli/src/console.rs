//! Standard error while a command runs: log lines, and progress with its rate and the time left. It is text
//! for a person, or one JSON object a line for a program.

use crate::upright::{upright_json, upright_line};
use clap::ValueEnum;
use indicatif::{
    HumanFloatCount, MultiProgress, ProgressBar, ProgressDrawTarget, ProgressState, ProgressStyle,
};
use s3d_dataset::Event;
use s3d_dataset::event::{MessageLevel, Task};
use s3d_dataset::summary::UnitTally;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::io::{self, IsTerminal, Write};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant};
use tracing::field::{Field, Visit};
use tracing::level_filters::LevelFilter;
use tracing::{Subscriber, debug, info, warn};
use tracing_subscriber::fmt::format::{FormatEvent, FormatFields, Writer};
use tracing_subscriber::fmt::{FmtContext, MakeWriter};
use tracing_subscriber::registry::LookupSpan;

/// The time between two lines of progress in a text log, where no terminal shows bars.
const LOG_EVERY: Duration = Duration::from_secs(15);

/// The time between two lines of progress in JSON.
const EVENT_EVERY: Duration = Duration::from_secs(3);

static CONSOLE: OnceLock<Console> = OnceLock::new();
/// The progress of the tasks under way, by their ids.
static TASKS: Mutex<BTreeMap<u64, Progress>> = Mutex::new(BTreeMap::new());

/// The form of standard error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum LogFormat {
    /// For a person.
    #[default]
    Text,
    /// For a program: one JSON object a line. The page "Messages and exit codes" of the documentation
    /// describes the objects.
    Json,
}

struct Console {
    json: bool,
    quiet: bool,
    bars: Option<MultiProgress>,
    started: Instant,
}

/// Starts logging to standard error: `-v` details, `-q` warnings only. Progress bars are drawn if standard
/// error is a terminal and the log is text.
pub(crate) fn start(verbose: bool, quiet: bool, format: LogFormat) {
    let level = if verbose {
        LevelFilter::DEBUG
    } else if quiet {
        LevelFilter::WARN
    } else {
        LevelFilter::INFO
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
    if json {
        log.event_format(JsonLines).init()
    } else {
        log.init()
    }
}

/// Whether standard error is JSON for a program.
fn is_json() -> bool {
    CONSOLE.get().is_some_and(|c| c.json)
}

/// Removes the bars from the terminal.
pub(crate) fn clear() {
    if let Some(bars) = bars() {
        let _ = bars.clear();
    }
}

fn bars() -> Option<&'static MultiProgress> {
    CONSOLE.get()?.bars.as_ref()
}

/// A line of JSON that is no event of the library.
#[derive(Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
enum Line<'a> {
    /// The first line: the command has begun.
    Started {
        version: &'a str,
        /// The command line.
        command: &'a [String],
    },
    /// A line that the text log has as well.
    Log {
        /// `error`, `warning`, `info` or `debug`.
        level: &'a str,
        message: &'a str,
    },
    /// How far a piece of long work is.
    Progress {
        /// The work: "rendering".
        what: &'a str,
        /// The units that are counted: "images".
        unit: &'a str,
        done: u64,
        total: u64,
        /// Units a second since the work began.
        rate: f64,
        /// The time left at that rate; null before the first unit is done.
        seconds_left: Option<f64>,
    },
    /// The last line: the command ends with this exit code.
    Finished { exit_code: u8 },
}

/// Writes that the command with these words has begun, if the log is JSON.
pub(crate) fn started(command: &[String]) {
    write_json(&Line::Started { version: env!("CARGO_PKG_VERSION"), command }, false);
}

/// Writes that the command ends with this exit code, if the log is JSON.
pub(crate) fn finished(exit_code: u8) {
    write_json(&Line::Finished { exit_code }, true);
}

/// Writes an event of a call: a line of JSON with `--log json`, otherwise a log line or a bar if a person
/// wants to know it.
pub(crate) fn observe(event: &Event<'_>) {
    match event {
        Event::Message { level: MessageLevel::Warning, text } => warn!("{text}"),
        Event::Message { level: MessageLevel::Info, text } => info!("{text}"),
        Event::Message { text, .. } => debug!("{text}"),

        Event::TaskStarted { task } => {
            tasks().insert(task.id, Progress::new(task));
        }
        Event::TaskAdvanced { task, done } => {
            if let Some(progress) = tasks().get_mut(&task.id) {
                progress.advance(task, *done);
            }
        }
        Event::TaskEnded { task } => {
            // The lock is released before the bar is cleared.
            let ended = tasks().remove(&task.id);
            drop(ended);
        }

        // Everything below is one line in JSON.
        Event::StageStarted { .. } => {}
        event if is_json() => write_json(event, matches!(event, Event::Summary(_))),

        Event::UnitFinished { unit, area, location, tally, seconds } => {
            let location = location.map_or_else(String::new, |l| format!(" {l}"));
            let UnitTally { files, bytes, .. } = tally;
            debug!("area {area}: {unit}{location} done: {files} files, {bytes} bytes ({seconds:.1} s)");
        }
        Event::UnitsTaken { units, tally, seconds } => {
            debug!("{units} units of an earlier run are whole: {} files ({seconds:.1} s)", tally.files);
        }
        Event::StageFinished { stage, area, seconds } => match area {
            Some(area) => debug!("area {area}: {} done ({seconds:.1} s)", stage.name()),
            None => debug!("{} done ({seconds:.1} s)", stage.name()),
        },
        Event::Summary(summary) => summary.lines().iter().for_each(|line| info!("{line}")),
        _ => {}
    }
}

fn tasks() -> MutexGuard<'static, BTreeMap<u64, Progress>> {
    TASKS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Writes a line to standard error if the log is JSON. With `--quiet` only essential lines are written.
fn write_json(line: &impl Serialize, essential: bool) {
    if is_json() && (essential || !CONSOLE.get().is_some_and(|c| c.quiet)) {
        let _ = LineAboveBars.write(json_line(line).as_bytes());
    }
}

/// Returns the line with the seconds since the console started, and a line feed.
fn json_line(line: &impl Serialize) -> String {
    #[derive(Serialize)]
    struct Timed<'a, T> {
        #[serde(flatten)]
        line: &'a T,
        at_seconds: f64,
    }
    let at_seconds = CONSOLE.get().map_or(0.0, |c| c.started.elapsed().as_secs_f64());
    // Every line can be JSON: keys are texts, and numbers that are not finite become null.
    let mut text = serde_json::to_string(&Timed { line, at_seconds: thousandths(at_seconds) })
        .unwrap_or_else(|_| String::from("{\"event\":\"unknown\"}"));
    text.push('\n');
    text
}

/// Rounds seconds to milliseconds.
fn thousandths(seconds: f64) -> f64 {
    (1000.0 * seconds).round() / 1000.0
}

/// Formats log lines as events in JSON.
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
            tracing::Level::ERROR => "error",
            tracing::Level::WARN => "warning",
            tracing::Level::INFO => "info",
            _ => "debug",
        };
        writer.write_str(&json_line(&Line::Log { level, message: &message.0 }))
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
    /// Never fails: hours of work go on although nobody reads the log any more.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        let text = String::from_utf8_lossy(line);
        let shown = if is_json() {
            upright_json(&text)
        } else {
            upright_line(&text)
        };
        let _ = match bars() {
            Some(bars) => bars.suspend(|| io::stderr().write_all(shown.as_bytes())),
            None => io::stderr().write_all(shown.as_bytes()),
        };
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        let _ = io::stderr().flush();
        Ok(())
    }
}

/// The progress of one piece of long work: a bar on a terminal, a log line now and then elsewhere.
struct Progress {
    bar: Option<ProgressBar>,
    started: Instant,
    /// The largest count so far.
    done: u64,
    said: Instant,
}

impl Progress {
    fn new(task: &Task) -> Self {
        let bar = bars().map(|bars| {
            let bar = bars.add(ProgressBar::new(task.total));
            let template = "{prefix:>12} [{bar:40}] {human_pos}/{human_len} {msg}, {rate}, {eta} left";
            if let Ok(style) = ProgressStyle::with_template(template) {
                let rate = |state: &ProgressState, out: &mut dyn fmt::Write| {
                    let _ = write!(out, "{}/s", HumanFloatCount(round_rate(state.per_sec())));
                };
                bar.set_style(style.with_key("rate", rate).progress_chars("=> "));
            }
            bar.set_prefix(task.what);
            bar.set_message(task.unit);
            bar.enable_steady_tick(Duration::from_millis(250));
            bar
        });
        let now = Instant::now();
        Self { bar, started: now, done: 0, said: now }
    }

    /// Records that `done` units are done. Threads report in any order.
    fn advance(&mut self, task: &Task, done: u64) {
        self.done = self.done.max(done);
        if let Some(bar) = &self.bar {
            return bar.set_position(self.done);
        }

        // The last count is a line in JSON only.
        let json = is_json();
        let ended = self.done >= task.total;
        let due = self.said.elapsed() >= if json { EVENT_EVERY } else { LOG_EVERY };
        let is_said = if json { due || ended } else { due && !ended };
        if !is_said {
            return;
        }

        self.said = Instant::now();
        let rate = self.done as f64 / self.started.elapsed().as_secs_f64();
        let left = task.total.saturating_sub(self.done) as f64 / rate;
        let Task { what, unit, total, .. } = *task;
        if json {
            let seconds_left = left.is_finite().then(|| thousandths(left));
            let rate = thousandths(rate);
            write_json(&Line::Progress { what, unit, done: self.done, total, rate, seconds_left }, false);
        } else if self.done == 0 {
            info!("{what} 0/{total} {unit}");
        } else {
            let rate = round_rate(rate);
            info!("{what} {}/{total} {unit}, {rate}/s, {left:.0} s left", self.done);
        }
    }
}

/// Rounds a rate: below 10 to one decimal, otherwise to a whole number.
fn round_rate(rate: f64) -> f64 {
    if rate < 10.0 {
        (10.0 * rate).round() / 10.0
    } else {
        rate.round()
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
