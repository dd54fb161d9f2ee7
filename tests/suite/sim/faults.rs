//! How faults are chosen, caused and repaired.

use std::time::Duration;

use super::events::{Event, Fault, Link};
use super::run::Run;
use super::stage::Place;

/// The most coordinators that are killed.
const MOST_COORDINATORS: u32 = 4;

impl Run {
    /// Plan the next fault, at a random time.
    pub(super) fn plan_fault(&mut self) {
        if self.faults_left > 0 {
            self.faults_left -= 1;
            let pause = self.chance.time(0, self.pause_ms);
            self.plan(pause, Event::Fault);
        }
    }

    /// Plan an event after this time.
    fn plan(&mut self, after: Duration, event: Event) {
        self.planned += 1;
        self.events.insert((self.sim.elapsed() + after, self.planned), event);
    }

    pub(super) fn perform(&mut self, event: Event) {
        match event {
            Event::Fault => {
                let (fault, index) = (Fault::draw(&mut self.chance), self.chance.index(self.workers));
                if self.inject(fault, index) {
                    *self.faults.entry(fault.name()).or_default() += 1;
                }
                self.plan_fault();
            }
            Event::MendLink(index, link) => self.mend(index, link),
            Event::Reset(control) => control.upgrade().iter().for_each(|control| control.reset()),
            Event::Start(place) => {
                self.absent.remove(&place);
                if place == Place::Coordinator {
                    self.stage.state().joined.clear();
                }
                self.sim.bounce(place.host());
            }
            Event::Unstick(index) => _ = self.stage.state().stuck.remove(&Place::Worker(index)),
            Event::Hurry(index) => _ = self.stage.state().slow.remove(&Place::Worker(index)),
            Event::Insist(wishes) => wishes.end.cancel(),
        }
    }

    /// Cause a fault of a worker or of the coordinator. Returns whether that was possible.
    fn inject(&mut self, fault: Fault, index: usize) -> bool {
        let time = fault.time(&mut self.chance);
        let is_coordinator = matches!(fault, Fault::KillCoordinator | Fault::KillAll);
        let place = if is_coordinator { Place::Coordinator } else { Place::Worker(index) };
        let needs_link = matches!(fault, Fault::Link(_) | Fault::PowerOff);
        if self.absent.contains(&place) || needs_link && self.broken.contains_key(&index) {
            return false;
        }
        let kills = [Fault::KillCoordinator, Fault::KillAll].map(|fault| self.faults.get(fault.name()).copied());
        if is_coordinator && kills.into_iter().flatten().sum::<u32>() >= MOST_COORDINATORS {
            return false;
        }
        let wishes = self.stage.state().wishes.get(&place).cloned();
        self.stage.note(self.sim.elapsed(), place, &format!("* {} for {time:?}", fault.name()));
        match fault {
            Fault::Link(Link::Slow) | Fault::SlowDown | Fault::KillCoordinator | Fault::KillAll => {}
            _ => self.harm(place),
        }
        match fault {
            Fault::Link(link) => self.break_link(index, link, time),
            Fault::ResetConnections => self.reset_ends(index, time),
            Fault::KillWorker | Fault::KillCoordinator => self.kill(place, time),
            Fault::KillAll => self.kill_all(time),
            Fault::PowerOff => {
                self.break_link(index, Link::Cut, time);
                self.kill(place, time);
            }
            Fault::Drain => {
                let Some(wishes) = wishes else { return false };
                wishes.drain.cancel();
                if self.chance.happens(0.3) {
                    self.plan(time, Event::Insist(wishes));
                }
            }
            Fault::Stick => {
                self.stage.state().stuck.insert(place);
                self.plan(time, Event::Unstick(index));
            }
            Fault::SlowDown => {
                let factor = u32::try_from(self.chance.between(2, 5)).unwrap_or(2);
                self.stage.state().slow.insert(place, factor);
                self.plan(time, Event::Hurry(index));
            }
        }
        true
    }

    /// Record that the process in a place may now leave without being asked.
    fn harm(&mut self, place: Place) {
        let process = self.stage.process(place);
        self.stage.state().harmed.insert(process);
    }

    /// Kill the coordinator and about half of the workers, which return after it, most of them one after the other.
    fn kill_all(&mut self, time: Duration) {
        self.kill(Place::Coordinator, time);
        for index in 0..self.workers {
            let place = Place::Worker(index);
            if self.chance.happens(0.5) && !self.absent.contains(&place) {
                self.harm(place);
                let after = time + self.chance.time(0, 15_000);
                self.kill(place, after);
            }
        }
    }

    fn kill(&mut self, place: Place, time: Duration) {
        self.crash(place);
        if place == Place::Coordinator {
            self.coordinators_ended.push(self.sim.elapsed());
        }
        self.gone(place);
        self.plan(time, Event::Start(place));
    }

    /// End a process. The order in which its connections end depends on how many tasks the test's process ever had, so the last packets
    /// must not draw latencies of their own: all arrive at once, or, where a link is cut in one direction, never.
    fn crash(&mut self, place: Place) {
        let links = match place {
            Place::Coordinator => 0..self.workers,
            Place::Worker(index) => index..index + 1,
        };
        let near = Place::Coordinator.host();
        for index in links.clone() {
            let far = Place::Worker(index).host();
            match self.broken.get(&index) {
                None | Some(Link::Slow) => self.sim.hold(near.as_str(), far),
                Some(Link::CutDown | Link::CutUp) => self.sim.partition(near.as_str(), far),
                Some(Link::Held | Link::Cut) => {}
            }
        }
        self.sim.crash(place.host());
        for index in links {
            let far = Place::Worker(index).host();
            match self.broken.get(&index) {
                None | Some(Link::Slow) => self.sim.release(near.as_str(), far),
                Some(Link::CutDown) => self.sim.repair_oneway(far, near.as_str()),
                Some(Link::CutUp) => self.sim.repair_oneway(near.as_str(), far),
                Some(Link::Held | Link::Cut) => {}
            }
        }
    }

    /// Record that a place has no process.
    fn gone(&mut self, place: Place) {
        self.absent.insert(place);
        let mut state = self.stage.state();
        state.wishes.remove(&place);
        state.stuck.remove(&place);
    }

    fn break_link(&mut self, index: usize, link: Link, time: Duration) {
        let (near, far) = (Place::Coordinator.host(), Place::Worker(index).host());
        self.broken.insert(index, link);
        match link {
            Link::Held => self.sim.hold(near, far),
            Link::Cut => self.sim.partition(near, far),
            Link::CutDown => self.sim.partition_oneway(near, far),
            Link::CutUp => self.sim.partition_oneway(far, near),
            Link::Slow => self.sim.set_link_latency(near, far, self.chance.time(100, 400)),
        }
        // Otherwise the connections are not reset, and each end has to notice the silence.
        if matches!(link, Link::Cut | Link::CutDown | Link::CutUp) && self.chance.happens(0.5) {
            self.reset_ends(index, time + Duration::from_secs(2));
        }
        self.plan(time, Event::MendLink(index, link));
    }

    fn mend(&mut self, index: usize, link: Link) {
        let (near, far) = (Place::Coordinator.host(), Place::Worker(index).host());
        let place = Place::Worker(index);
        self.broken.remove(&index);
        self.stage.note(self.sim.elapsed(), place, &format!("* no longer {}", Fault::Link(link).name()));
        match link {
            Link::Held => self.sim.release(near, far),
            Link::Cut | Link::CutDown | Link::CutUp => {
                self.sim.repair(near, far);
                if self.chance.happens(0.5) {
                    self.reset_ends(index, Duration::ZERO);
                }
            }
            Link::Slow => self.sim.set_link_latency(near, far, self.chance.time(1, 100)),
        }
        // The place may have another process by now.
        if link != Link::Slow {
            self.harm(place);
        }
    }

    /// Reset both ends of every connection of a worker, each at its own time.
    fn reset_ends(&mut self, index: usize, within: Duration) {
        let most = u64::try_from(within.as_millis()).unwrap_or(0);
        for (_, control) in self.stage.wires(Place::Worker(index)) {
            let after = self.chance.time(0, most);
            self.plan(after, Event::Reset(control));
        }
    }

    /// Handle the processes that have ended.
    pub(super) fn mark_dead(&mut self) {
        let mut state = self.stage.state();
        let (dying, ended) = (std::mem::take(&mut state.dying), std::mem::take(&mut state.ended));
        drop(state);
        for place in dying {
            self.harm(place);
            let pause = self.chance.time(10, 1000);
            self.kill(place, pause);
            *self.faults.entry("worker killed by its node").or_default() += 1;
        }
        for (index, was_asked) in ended {
            if !was_asked {
                self.left_unasked.push((index, self.sim.elapsed()));
            }
            let pause = self.chance.time(10, 3000);
            self.gone(Place::Worker(index));
            self.plan(pause, Event::Start(Place::Worker(index)));
        }
    }
}
