//! What a long call is handed by its caller: a way to end it early, and somebody to tell what happens.

use crate::error::{Error, Result};
use crate::event::{Event, Level, Task};
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Ends calls early, from any thread or a signal handler's thread. Clones are the same switch.
///
/// ```
/// let cancel = s3d_dataset::Cancel::default();
/// let theirs = cancel.clone();
/// std::thread::spawn(move || theirs.cancel()).join().unwrap();
/// assert!(cancel.is_cancelled());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Cancel(Arc<AtomicBool>);

impl Cancel {
    /// Asks for an end. Calls that were handed this switch end at the next file, chunk of points or instance
    /// with [`Error::Cancelled`].
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether an end was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Takes the wish back, so that the switch serves for another call.
    pub fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

impl From<Arc<AtomicBool>> for Cancel {
    /// The switch that this flag is, such as one that a handler of signals sets.
    fn from(flag: Arc<AtomicBool>) -> Self {
        Self(flag)
    }
}

/// Who is told what happens during a call: see [`Event`]. It is called from all threads that work, and should
/// return soon. Closures are observers.
pub trait Observer: Send + Sync {
    /// Something happened.
    fn observe(&self, event: &Event<'_>);
}

impl<F: Fn(&Event<'_>) + Send + Sync> Observer for F {
    fn observe(&self, event: &Event<'_>) {
        self(event);
    }
}

/// What calls of this crate are handed besides their options. The default watches nothing and never ends
/// early.
///
/// ```
/// use s3d_dataset::{Context, Event};
///
/// let context = Context::default().observed_by(|event: &Event<'_>| {
///     if let Event::Message { text, .. } = event {
///         eprintln!("{text}");
///     }
/// });
/// assert!(!context.cancel.is_cancelled());
/// ```
#[derive(Clone, Default)]
pub struct Context {
    /// Ends the call early.
    pub cancel: Cancel,
    /// Is told what happens; nobody if `None`.
    pub observer: Option<Arc<dyn Observer>>,
    warnings: Arc<AtomicU64>,
    /// Where warnings are written down, if they are.
    notes: Option<Arc<Mutex<Vec<String>>>>,
}

impl fmt::Debug for Context {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Context")
            .field("cancel", &self.cancel)
            .field("observer", &self.observer.is_some())
            .finish()
    }
}

impl Context {
    /// The same, ended early by `cancel`.
    pub fn cancelled_by(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// The same, watched by `observer`.
    pub fn observed_by(self, observer: impl Observer + 'static) -> Self {
        Self { observer: Some(Arc::new(observer)), ..self }
    }

    /// Between two pieces of work.
    ///
    /// # Errors
    /// [`Error::Cancelled`] if an end was asked for.
    pub fn check(&self) -> Result<()> {
        if self.cancel.is_cancelled() {
            Err(Error::Cancelled)
        } else {
            Ok(())
        }
    }

    pub(crate) fn tell(&self, event: &Event<'_>) {
        if let Some(observer) = &self.observer {
            observer.observe(event);
        }
    }

    fn message(&self, level: Level, text: impl fmt::Display) {
        if self.observer.is_some() {
            self.tell(&Event::Message { level, text: &text.to_string() });
        }
    }

    /// How many warnings there were so far, with this context and its clones.
    pub fn warnings(&self) -> u64 {
        self.warnings.load(Ordering::Relaxed)
    }

    /// Tells of something that should be looked at, and counts it.
    pub fn warn(&self, text: impl fmt::Display) {
        self.warnings.fetch_add(1, Ordering::Relaxed);
        if let Some(notes) = &self.notes {
            notes
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(text.to_string());
        }
        self.message(Level::Warning, text);
    }

    /// The same, which writes its warnings down as well.
    pub(crate) fn noting(&self) -> Self {
        Self { notes: Some(Arc::default()), ..self.clone() }
    }

    /// The warnings that were written down since they were taken last.
    pub(crate) fn take_notes(&self) -> Vec<String> {
        let notes = self
            .notes
            .as_ref()
            .map(|notes| notes.lock().unwrap_or_else(PoisonError::into_inner));
        notes.map(|mut notes| std::mem::take(&mut *notes)).unwrap_or_default()
    }

    /// Tells of what was done.
    pub fn info(&self, text: impl fmt::Display) {
        self.message(Level::Info, text);
    }

    pub(crate) fn debug(&self, text: impl fmt::Display) {
        self.message(Level::Debug, text);
    }

    /// A warning for each sentence.
    pub(crate) fn warn_each<T: fmt::Display>(&self, texts: impl IntoIterator<Item = T>) {
        texts.into_iter().for_each(|text| self.warn(text));
    }

    /// Begins `total` units of long work, named by what is done ("rendering") to what ("images").
    /// What is returned is told of every unit, and ends the task when it is dropped.
    pub fn progress(&self, what: &'static str, unit: &'static str, total: u64) -> Progress<'_> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let task = Task { id: NEXT.fetch_add(1, Ordering::Relaxed), what, unit, total };
        self.tell(&Event::TaskStarted { task });
        Progress { context: self, task, done: AtomicU64::new(0) }
    }
}

/// Tells how far a [`Task`] is, by any thread; dropped, the task has ended.
pub struct Progress<'a> {
    pub(crate) context: &'a Context,
    task: Task,
    done: AtomicU64,
}

impl Progress<'_> {
    /// `n` more units are done.
    pub fn add(&self, n: u64) {
        let done = self.done.fetch_add(n, Ordering::Relaxed) + n;
        self.context.tell(&Event::TaskAdvanced { task: self.task, done });
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        self.context.tell(&Event::TaskEnded { task: self.task });
    }
}
