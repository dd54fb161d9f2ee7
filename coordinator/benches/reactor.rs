//! What the reactor alone costs: a run of 100,000 nodes that do nothing, on 2 workers and on 1,000, without sockets and journal.
//!
//! `cargo bench -p lookalike-coordinator --bench reactor`; the time is that of the whole run.

use std::collections::VecDeque;
use std::time::Duration;

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use lookalike::graph::{Blob, GraphEdit, NodeId, NodeSpec, Placement, PlanError, Planner, WorkerId};
use lookalike::protocol::ProcessName;
use lookalike_coordinator::actions::{Action, Outbox, WorkerProcess};
use lookalike_coordinator::events::Site;
use lookalike_coordinator::policy::Policy;
use lookalike_coordinator::reactor::{Event, handle, start};
use lookalike_coordinator::state::Core;

const NODES: usize = 100_000;

/// How long a worker takes from the start of a node to its end.
const NODE_TIME: Duration = Duration::from_micros(50);

struct Independent;

impl Planner for Independent {
    fn start(&mut self, graph: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        (0..NODES).try_for_each(|number| {
            let (kind, label, parameters) = ("nothing".into(), format!("node {number}"), number.to_le_bytes().to_vec());
            let spec = NodeSpec {
                kind,
                label: label.into(),
                parameters,
                inputs: Vec::new(),
                placement: Placement::Worker,
                priority: 0,
            };
            graph.add_node(spec).map(|_| ())
        })
    }

    fn completed(&mut self, _: NodeId, _: &Blob, _: &mut GraphEdit<'_>) -> Result<(), PlanError> {
        Ok(())
    }
}

/// A run that has begun.
struct Run {
    core: Core,
    outbox: Outbox,
    now: Duration,
    /// What the workers were given, in order.
    given: VecDeque<(WorkerId, NodeId, u32)>,
}

impl Run {
    fn begin(workers: u64) -> Self {
        let mut core = Core::new(Policy::default(), 1);
        let mut outbox = Outbox::default();
        start(&mut core, &mut Independent, Duration::ZERO, &mut outbox).expect("a plan");
        let mut run = Self { core, outbox, now: Duration::ZERO, given: VecDeque::new() };
        for worker in (1..=workers).map(WorkerId) {
            let name = ProcessName(u128::from(worker.0).to_le_bytes());
            let process = WorkerProcess { id: 0, name, is_local: false };
            run.handle(Event::WorkerJoined { worker, threads: 1, process });
        }
        run
    }

    fn handle(&mut self, event: Event) {
        handle(&mut self.core, &mut Independent, event, self.now, &mut self.outbox).expect("a run without errors");
        for action in self.outbox.take() {
            if let Action::Assign { worker, lease } = action {
                self.given.push_back((worker, lease.node, lease.attempt));
            }
        }
    }

    fn finish(mut self, output: &Blob) -> Self {
        while let Some((worker, node, attempt)) = self.given.pop_front() {
            self.handle(Event::Started { worker, node, attempt });
            self.now += NODE_TIME;
            self.handle(Event::Finished { site: Site::Worker(worker), node, attempt, output: output.clone() });
        }
        assert!(self.core.is_finished());
        self
    }
}

fn reactor(criterion: &mut Criterion) {
    let output = Blob::new(vec![0; 8]);
    let mut group = criterion.benchmark_group("reactor, 100,000 nodes");
    group.sample_size(10);
    for workers in [2, 1000] {
        group.bench_function(format!("{workers} workers"), |bencher| {
            bencher.iter_batched(|| Run::begin(workers), |run| run.finish(&output), BatchSize::PerIteration);
        });
    }
    group.finish();
}

criterion_group!(benches, reactor);
criterion_main!(benches);
