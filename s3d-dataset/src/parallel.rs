//! Runs many independent pieces of work on all threads.

use crate::context::Context;
use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};

/// Runs `work` on every item, on all threads of the current pool. Items are handed out one at a time and in
/// order, so a slow item delays no other, and each thread works on at most one. After a failure or a request
/// to end, no further item is begun. Returns the failure of the first failed item, by order. `state` makes a
/// state for each thread: memory to use again, on which no result may depend.
pub(crate) fn for_each_in_order<T: Sync, S>(
    ctx: &Context,
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &T) -> Result<()> + Sync,
) -> Result<()> {
    let next = AtomicUsize::new(0);
    let ended = AtomicBool::new(false);
    let failure: Mutex<Option<(usize, Error)>> = Mutex::new(None);

    rayon::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(items.len()) {
            scope.spawn(|_| {
                let mut state = state();
                while !ended.load(Ordering::Relaxed) {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(i) else { break };
                    if let Err(e) = ctx.check().and_then(|()| work(&mut state, item)) {
                        ended.store(true, Ordering::Relaxed);
                        let mut first = failure.lock().unwrap_or_else(PoisonError::into_inner);
                        if first.as_ref().is_none_or(|(j, _)| i < *j) {
                            *first = Some((i, e));
                        }
                    }
                }
            });
        }
    });

    match failure.into_inner().unwrap_or_else(PoisonError::into_inner) {
        Some((_, e)) => Err(e),
        None => Ok(()),
    }
}

/// Runs `work` on every item, on all threads of the current rayon pool, and returns the results in the order
/// of the items. Items are handed out one at a time and in order. After a failure no further item is begun,
/// and the failure of the first failed item is returned. `state` makes a state for each thread: memory to use
/// again, on which no result may depend.
///
/// # Errors
/// The errors of `work`, and [`Error::Cancelled`].
pub fn map_in_order<T: Sync, S, R: Send + Sync>(
    ctx: &Context,
    items: &[T],
    state: impl Fn() -> S + Sync,
    work: impl Fn(&mut S, &T) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let results: Vec<OnceLock<R>> = items.iter().map(|_| OnceLock::new()).collect();
    let jobs: Vec<(&T, &OnceLock<R>)> = items.iter().zip(&results).collect();
    for_each_in_order(ctx, &jobs, state, |state, (item, result)| {
        let _ = result.set(work(state, item)?);
        Ok(())
    })?;
    Ok(results
        .into_iter()
        .map(|r| r.into_inner().expect("every item was done"))
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicU64;

    #[test]
    fn every_item_is_done_once() {
        let items: Vec<u64> = (0..1000).collect();
        let sum = AtomicU64::new(0);
        for_each_in_order(
            &Context::default(),
            &items,
            || (),
            |(), i| {
                sum.fetch_add(*i, Ordering::Relaxed);
                Ok(())
            },
        )
        .unwrap();
        assert_eq!(sum.into_inner(), 499_500);
    }

    #[test]
    fn the_first_failure_is_told() {
        let items: Vec<u64> = (0..1000).collect();
        let e = for_each_in_order(
            &Context::default(),
            &items,
            || (),
            |(), i| {
                if *i == 7 {
                    Err(Error::unfit(format!("item {i}"), "wrong"))
                } else {
                    Ok(())
                }
            },
        );
        assert_eq!(e.unwrap_err().to_string(), "item 7: wrong");
    }

    #[test]
    fn results_are_in_order() {
        let items: Vec<u32> = (0..500).collect();
        let squares = map_in_order(&Context::default(), &items, || (), |(), i| Ok(i * i)).unwrap();
        assert!(squares.iter().enumerate().all(|(i, s)| *s as usize == i * i));
    }
}
