//! Work without Python's lock: it runs on a pool of threads, reports progress, and ends at Ctrl-C.

use crate::error::{exception, fault};
use pyo3::prelude::*;
use pyo3::types::PyBool;
use s3d_dataset::event::{MessageLevel, Task};
use s3d_dataset::{Cancel, Context, Event, Result};
use std::collections::BTreeMap;
use std::panic::resume_unwind;
use std::process;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// The time between two looks for signals and news of the work.
const LOOK_EVERY: Duration = Duration::from_millis(100);

/// The pool that calls share, and the process that started its threads.
static POOL: Mutex<Option<(u32, Arc<rayon::ThreadPool>)>> = Mutex::new(None);

/// Returns a pool of `threads` threads, or the pool that calls share, of one thread a core, if that is
/// `None`. A forked process has none of the threads of its parent, so it gets a pool of its own.
fn pool(threads: Option<usize>) -> PyResult<Arc<rayon::ThreadPool>> {
    if let Some(threads) = threads {
        return start_pool(threads);
    }
    let mut shared = POOL.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((id, pool)) = &*shared
        && *id == process::id()
    {
        return Ok(Arc::clone(pool));
    }
    let pool = start_pool(0)?;
    // The parent's pool is not dropped: that would wait for threads that do not exist here.
    std::mem::forget(shared.replace((process::id(), Arc::clone(&pool))));
    Ok(pool)
}

/// Starts a pool of `threads` threads; 0 means one a core.
fn start_pool(threads: usize) -> PyResult<Arc<rayon::ThreadPool>> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Arc::new)
        .map_err(|e| fault(format!("threads cannot be started: {e}")))
}

/// Makes a short call on a pool, without Python's lock.
pub(crate) fn detached<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    call: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    py.detach(|| Ok(pool(threads)?.install(call)))
}

/// Makes a long call on a pool, without Python's lock. Meanwhile this thread passes news to `sink`
/// (`_progress.Sink`) and asks Python for signals. An exception cancels the call, whether a signal such as
/// Ctrl-C or `sink` raises it, and is raised when the call has ended. The answer False of `sink` cancels the
/// call as well.
pub(crate) fn watched<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    sink: &Py<PyAny>,
    call: impl FnOnce(&Context) -> Result<T> + Send,
) -> PyResult<T> {
    py.detach(|| {
        let pool = pool(threads)?;
        let (told, news) = channel();
        let cancel = Cancel::default();
        let context = Context::default()
            .cancelled_by(cancel.clone())
            .observed_by(observer(told));
        let (outcome, raised) = thread::scope(|scope| {
            let work = scope.spawn(move || pool.install(move || call(&context)));
            let raised = wait(&news, sink, &cancel, || work.is_finished());
            (work.join(), raised)
        });
        let outcome = outcome.unwrap_or_else(|panic| resume_unwind(panic));
        match raised {
            // The exception counts even if the call succeeded before it took effect.
            Some(error) => Err(error),
            None => outcome.map_err(|error| exception(&error)),
        }
    })
}

/// An event that outlives its call.
enum News {
    Message(MessageLevel, String),
    Started(Task),
    Advanced(u64, u64),
    Ended(u64),
}

fn observer(told: Sender<News>) -> impl Fn(&Event<'_>) + Send + Sync {
    move |event| {
        let news = match event {
            Event::Message { level, text } => News::Message(*level, (*text).to_owned()),
            Event::TaskStarted { task } => News::Started(*task),
            Event::TaskAdvanced { task, done } => News::Advanced(task.id, *done),
            Event::TaskEnded { task } => News::Ended(task.id),
            _ => return,
        };
        // Nobody receives news after the end of the call.
        let _ = told.send(news);
    }
}

/// Passes news on until the work is done, and returns the first exception of Python.
fn wait(
    news: &Receiver<News>,
    sink: &Py<PyAny>,
    cancel: &Cancel,
    is_done: impl Fn() -> bool,
) -> Option<PyErr> {
    let mut raised: Option<PyErr> = None;
    loop {
        let (batch, ended) = next_batch(news);
        Python::attach(|py| {
            let told = if raised.is_none() {
                tell(py, sink, batch, cancel)
            } else {
                Ok(())
            };
            if let Err(error) = told.and_then(|()| py.check_signals()) {
                cancel.cancel();
                raised.get_or_insert(error);
            }
        });
        if ended || is_done() {
            break;
        }
    }

    let rest: Vec<News> = news.try_iter().collect();
    if raised.is_none() {
        raised = Python::attach(|py| tell(py, sink, rest, cancel)).err();
    }
    raised
}

/// Returns the news of one [`LOOK_EVERY`], and whether they were the last.
fn next_batch(news: &Receiver<News>) -> (Vec<News>, bool) {
    let until = Instant::now() + LOOK_EVERY;
    let mut batch = Vec::new();
    loop {
        let left = until.saturating_duration_since(Instant::now());
        match news.recv_timeout(left) {
            Ok(one) => batch.push(one),
            Err(end) => return (batch, end == RecvTimeoutError::Disconnected),
        }
        // News may come without a pause.
        if left.is_zero() {
            return (batch, false);
        }
    }
}

/// Passes news to the sink. Each task's progress is passed once, with its largest count.
fn tell(py: Python<'_>, sink: &Py<PyAny>, batch: Vec<News>, cancel: &Cancel) -> PyResult<()> {
    let mut done_of: BTreeMap<u64, u64> = BTreeMap::new();
    for news in &batch {
        if let News::Advanced(id, done) = news {
            let most = done_of.entry(*id).or_default();
            *most = (*most).max(*done);
        }
    }

    let advance = |id: u64, done: Option<u64>| -> PyResult<()> {
        let Some(done) = done else { return Ok(()) };
        let answer = sink.call_method1(py, "advanced", (id, done))?;
        if answer.bind(py).is(PyBool::new(py, false)) {
            cancel.cancel();
        }
        Ok(())
    };

    for news in batch {
        match news {
            News::Message(level, text) => {
                let level = match level {
                    MessageLevel::Warning => "warning",
                    MessageLevel::Info => "info",
                    MessageLevel::Debug => "debug",
                };
                sink.call_method1(py, "message", (level, text))?;
            }
            News::Started(task) => {
                sink.call_method1(py, "started", (task.id, task.what, task.unit, task.total))?;
            }
            News::Advanced(..) => {}
            News::Ended(id) => {
                advance(id, done_of.remove(&id))?;
                sink.call_method1(py, "ended", (id,))?;
            }
        }
    }
    done_of.into_iter().try_for_each(|(id, done)| advance(id, Some(done)))
}

/// Keeps the panics of decoders that readers catch and turn into errors from being printed.
pub(crate) fn hide_caught_panics() {
    let others = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        if !s3d_io::panic_is_caught() {
            others(panic);
        }
    }));
}
