//! Work that threads share. What comes out does not depend on how many there are.

use std::panic::resume_unwind;
use std::sync::Mutex;
use std::thread;

/// The results of a function over items, in the order of the items.
pub fn map<T: Send, R: Send>(items: Vec<T>, of: impl Fn(T) -> R + Sync) -> Vec<R> {
    map_with(items, || (), |(), item| of(item))
}

/// The same, where each thread has something that it uses again from item to item, and that no
/// result depends on.
pub fn map_with<T: Send, S, R: Send>(
    items: Vec<T>,
    own: impl Fn() -> S + Sync,
    of: impl Fn(&mut S, T) -> R + Sync,
) -> Vec<R> {
    let threads = thread::available_parallelism()
        .map_or(1, usize::from)
        .min(items.len());
    let left = Mutex::new(items.into_iter().enumerate());
    // Nobody panics while holding the lock.
    let next = || left.lock().ok()?.next();
    let work = || {
        let mut own = own();
        std::iter::from_fn(next)
            .map(|(at, item)| (at, of(&mut own, item)))
            .collect::<Vec<(usize, R)>>()
    };
    let mut all = thread::scope(|scope| {
        let others: Vec<_> = (1..threads).map(|_| scope.spawn(work)).collect();
        let mut all = work();
        for other in others {
            all.extend(other.join().unwrap_or_else(|panic| resume_unwind(panic)));
        }
        all
    });
    all.sort_unstable_by_key(|(at, _)| *at);
    all.into_iter().map(|(_, result)| result).collect()
}

/// Whether two threads run at once. (A module in a browser has one.)
pub fn has_threads() -> bool {
    !cfg!(target_family = "wasm") && thread::available_parallelism().is_ok_and(|n| n.get() > 1)
}

/// Two results, found at once where there are threads.
pub fn both<A: Send, B>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B) -> (A, B) {
    if cfg!(target_family = "wasm") {
        return (a(), b());
    }
    thread::scope(|scope| {
        let a = scope.spawn(a);
        let b = b();
        (a.join().unwrap_or_else(|panic| resume_unwind(panic)), b)
    })
}

#[cfg(test)]
mod tests {
    use super::{both, map};

    #[test]
    fn results_come_in_the_order_of_the_items() {
        let squares = |items: Vec<u64>| items.iter().map(|item| item * item).collect::<Vec<_>>();
        let items: Vec<u64> = (0..1000).collect();
        assert_eq!(map(items.clone(), |item| item * item), squares(items));
        assert_eq!(map(Vec::new(), |item: u64| item * item), []);
        assert_eq!(both(|| 1, || 2), (1, 2));
    }
}
