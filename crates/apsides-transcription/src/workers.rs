//! Threads for the nodes of long phases: what is written for a node does not depend on the piece that it is in, nor on the number
//! of threads.

use std::ops::Range;
use std::sync::Arc;

use rayon::iter::{IntoParallelRefMutIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuilder};

/// A function is shared between threads from so many nodes on: below, waking a thread costs what it saves.
const SHARED_NODES: usize = 3000;
/// More than one, so that a thread that is held up leaves its pieces to others.
const PIECES_PER_THREAD: usize = 4;

/// Threads that evaluate terms, or none where the thread of the caller does all.
#[derive(Clone, Debug, Default)]
pub struct Workers {
    pool: Option<Arc<ThreadPool>>,
}

impl Workers {
    /// So many threads; none where one is enough or the system gives no more.
    #[must_use]
    pub fn new(threads: usize) -> Self {
        if threads < 2 {
            return Self::default();
        }
        Self { pool: ThreadPoolBuilder::new().num_threads(threads).build().ok().map(Arc::new) }
    }

    /// The number of pieces that so many nodes are cut into; 1 when all are left to the thread of the caller.
    #[must_use]
    pub fn pieces(&self, nodes: usize) -> usize {
        match &self.pool {
            Some(pool) if nodes >= SHARED_NODES => pool.current_num_threads() * PIECES_PER_THREAD,
            _ => 1,
        }
    }

    /// Runs `work` where [`in_pieces`] finds the threads, if there are any.
    pub fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.pool {
            Some(pool) => pool.install(work),
            None => work(),
        }
    }

    /// Calls `work` for each item, on the threads if there are any.
    pub fn each<T: Send>(&self, items: &mut [T], work: impl Fn(&mut T) + Send + Sync) {
        match &self.pool {
            Some(pool) => pool.install(|| items.par_iter_mut().for_each(work)),
            None => items.iter_mut().for_each(work),
        }
    }
}

/// Calls `work(nodes, scratch, targets)` for consecutive pieces of `0..nodes`, one per scratch; each target has so many numbers
/// per node and comes cut to the piece. With a single scratch nothing is allocated.
pub fn in_pieces<S: Send, const K: usize>(
    scratch: &mut [S],
    nodes: usize,
    targets: [(&mut [f64], usize); K],
    work: impl Fn(Range<usize>, &mut S, [&mut [f64]; K]) + Sync,
) {
    if let [only] = scratch {
        return work(0..nodes, only, targets.map(|(slice, _)| slice));
    }
    let size = nodes.div_ceil(scratch.len().max(1));
    let mut rest = targets;
    let work = &work;
    rayon::scope(|scope| {
        for (k, scratch) in scratch.iter_mut().enumerate() {
            let piece = (k * size).min(nodes)..((k + 1) * size).min(nodes);
            let own = rest.each_mut().map(|(slice, width)| {
                let (head, tail) = std::mem::take(slice).split_at_mut(piece.len() * *width);
                *slice = tail;
                head
            });
            scope.spawn(move |_| work(piece, scratch, own));
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(nodes: usize, threads: usize) -> (usize, Vec<f64>) {
        let workers = Workers::new(threads);
        let pieces = workers.pieces(nodes);
        let mut target = vec![0.0; 2 * nodes];
        workers.run(|| {
            in_pieces(&mut vec![(); pieces], nodes, [(&mut target[..], 2)], |nodes, (), [own]| {
                for (node, pair) in nodes.zip(own.chunks_exact_mut(2)) {
                    pair.copy_from_slice(&[(node as f64).sin(), node as f64]);
                }
            });
        });
        (pieces, target)
    }

    #[test]
    fn pieces_cover_all_nodes_once() {
        let (pieces, target) = filled(SHARED_NODES + 1, 2);
        assert_eq!(pieces, 2 * PIECES_PER_THREAD);
        let (alone, expected) = filled(SHARED_NODES + 1, 1);
        assert_eq!(alone, 1);
        assert_eq!(target, expected);
        assert_eq!(target[2 * SHARED_NODES + 1], SHARED_NODES as f64);
        assert_eq!(filled(10, 2).0, 1);
    }

    #[test]
    fn each_item_is_worked_on() {
        for threads in [1, 3] {
            let mut items: Vec<usize> = (0..10).collect();
            Workers::new(threads).each(&mut items, |k| *k *= 2);
            assert_eq!(items, (0..10).map(|k| 2 * k).collect::<Vec<_>>());
        }
    }
}
