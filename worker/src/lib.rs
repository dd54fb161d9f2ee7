//! The worker: connects to a coordinator over TCP, runs nodes of the job graph on its rayon pool, returns results.
