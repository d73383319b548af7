//! Nodes in pieces, for several threads: what is written for a node does not depend on the piece that it is in.

use std::ops::Range;
use std::sync::Arc;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// A function is shared between threads from so many nodes on: below, waking a thread costs what it saves.
pub(crate) const SHARED_NODES: usize = 3000;
/// More than one, so that a thread that is held up leaves its pieces to others.
const PIECES_PER_THREAD: usize = 4;

/// Number of pieces for so many nodes and threads; 1: all on the thread of the caller.
pub(crate) fn pieces(nodes: usize, threads: usize) -> usize {
    if threads > 1 && nodes >= SHARED_NODES { threads * PIECES_PER_THREAD } else { 1 }
}

/// Threads for [`in_pieces`]; none where one is enough or the system gives no more.
pub(crate) fn pool(threads: usize) -> Option<Arc<ThreadPool>> {
    if threads < 2 {
        return None;
    }
    ThreadPoolBuilder::new().num_threads(threads).build().ok().map(Arc::new)
}

/// Runs `work` on the threads of the pool, if there is one.
pub(crate) fn within<R: Send>(pool: Option<&ThreadPool>, work: impl FnOnce() -> R + Send) -> R {
    match pool {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

/// Calls `work(nodes, scratch, targets)` for consecutive pieces of `0..nodes`, one per scratch; each target has so many numbers
/// per node and comes cut to the piece. With a single scratch nothing is allocated.
pub(crate) fn in_pieces<S: Send, const K: usize>(
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
