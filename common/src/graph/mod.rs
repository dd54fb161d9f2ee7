//! The job graph: typed nodes, content-addressed blobs, and the coordinator's state machine as a plain function.
