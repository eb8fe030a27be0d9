//! The context of a long call: a way to end it early, and an observer of what happens.

use crate::error::{Error, Result};
use crate::event::{Event, MessageLevel, Task};
use std::fmt;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Ends calls early, from any thread, such as a signal handler's. Clones share one switch.
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
    /// Asks for an end. Calls with this switch end at the next file, chunk of points or instance with
    /// [`Error::Cancelled`].
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns whether an end was asked for.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Resets the switch, so that it serves for another call.
    pub fn reset(&self) {
        self.0.store(false, Ordering::Relaxed);
    }
}

impl From<Arc<AtomicBool>> for Cancel {
    /// Makes a switch of a flag, such as one that a signal handler sets.
    fn from(flag: Arc<AtomicBool>) -> Self {
        Self(flag)
    }
}

/// An observer of what happens during a call: see [`Event`]. All working threads call it, so it should return
/// soon. Closures are observers.
pub trait Observer: Send + Sync {
    /// Receives an event.
    fn observe(&self, event: &Event<'_>);
}

impl<F: Fn(&Event<'_>) + Send + Sync> Observer for F {
    fn observe(&self, event: &Event<'_>) {
        self(event);
    }
}

/// The context of a call of this crate, beside its options. The default observes nothing and never ends
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
    /// The switch that ends the call early.
    pub cancel: Cancel,
    /// The observer of the call, if there is one.
    pub observer: Option<Arc<dyn Observer>>,
    warnings: Arc<AtomicU64>,
    /// The list of warnings, if they are to be kept.
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
    /// Returns the same context, ended early by `cancel`.
    pub fn cancelled_by(self, cancel: Cancel) -> Self {
        Self { cancel, ..self }
    }

    /// Returns the same context, observed by `observer`.
    pub fn observed_by(self, observer: impl Observer + 'static) -> Self {
        Self { observer: Some(Arc::new(observer)), ..self }
    }

    /// Checks between two pieces of work whether the call must end.
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

    fn message(&self, level: MessageLevel, text: impl fmt::Display) {
        if self.observer.is_some() {
            self.tell(&Event::Message { level, text: &text.to_string() });
        }
    }

    /// Returns the number of warnings so far, from this context and its clones.
    pub fn warnings(&self) -> u64 {
        self.warnings.load(Ordering::Relaxed)
    }

    /// Reports something that the user should look at, and counts it.
    pub fn warn(&self, text: impl fmt::Display) {
        self.warnings.fetch_add(1, Ordering::Relaxed);
        if let Some(notes) = &self.notes {
            notes
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(text.to_string());
        }
        self.message(MessageLevel::Warning, text);
    }

    /// Returns the same context, which also keeps its warnings.
    pub(crate) fn noting(&self) -> Self {
        Self { notes: Some(Arc::default()), ..self.clone() }
    }

    /// Returns the kept warnings since the last call.
    pub(crate) fn take_notes(&self) -> Vec<String> {
        let notes = self
            .notes
            .as_ref()
            .map(|notes| notes.lock().unwrap_or_else(PoisonError::into_inner));
        notes.map(|mut notes| std::mem::take(&mut *notes)).unwrap_or_default()
    }

    /// Reports what was done.
    pub fn info(&self, text: impl fmt::Display) {
        self.message(MessageLevel::Info, text);
    }

    pub(crate) fn debug(&self, text: impl fmt::Display) {
        self.message(MessageLevel::Debug, text);
    }

    /// Gives a warning for each sentence.
    pub(crate) fn warn_each<T: fmt::Display>(&self, texts: impl IntoIterator<Item = T>) {
        texts.into_iter().for_each(|text| self.warn(text));
    }

    /// Begins a task of `total` units, named by the action ("rendering") and the unit ("images"). The result
    /// counts the finished units, and ends the task when it is dropped.
    pub fn progress(&self, what: &'static str, unit: &'static str, total: u64) -> Progress<'_> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let task = Task { id: NEXT.fetch_add(1, Ordering::Relaxed), what, unit, total };
        self.tell(&Event::TaskStarted { task });
        Progress { context: self, task, done: AtomicU64::new(0) }
    }
}

/// Reports the progress of a [`Task`] from any thread. The task ends when it is dropped.
pub struct Progress<'a> {
    pub(crate) context: &'a Context,
    task: Task,
    done: AtomicU64,
}

impl Progress<'_> {
    /// Counts `n` more finished units.
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
