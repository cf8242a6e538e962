//! The simulated robot, running in real time on its own thread.

use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, TrySendError, sync_channel};
use std::time::{Duration, Instant};

use flqr_core::control::BalanceController;
use flqr_core::model::{RobotModel, State};
use flqr_core::record::Sample;
use flqr_core::simulate::{Simulation, SimulationSettings, TICK_S};

use crate::job::Waker;

/// The robot never tries to catch up on more than this; the rest is counted as late.
const CATCH_UP_STEPS: u64 = 400;
/// Batches that wait for the window, 2 s at 30 Hz.
const BATCH_CAPACITY: usize = 64;
const COMMAND_CAPACITY: usize = 64;

/// Commands to the running simulation.
#[derive(Clone, Debug)]
pub(crate) enum LiveCommand {
    /// New gains or feedforward, from the next step on.
    Controller(BalanceController),
    /// Another robot, which goes on from the present state.
    Robot(Box<RobotModel>, BalanceController),
    /// Back to the start.
    Reset(Box<RobotModel>, BalanceController),
    /// No robot: nothing runs until one comes.
    Clear,
    Pause(bool),
    Push {
        force_n: f64,
        duration_s: f64,
    },
    /// Time between two batches.
    Interval(Duration),
}

/// Samples since the last batch.
pub(crate) struct Batch {
    pub(crate) samples: Vec<Sample>,
    /// Counts resets; older batches are thrown away.
    pub(crate) run: u64,
    pub(crate) fell: bool,
    /// Simulated time that was skipped because the machine was too slow, s.
    pub(crate) late_s: f64,
    pub(crate) problem: Option<String>,
}

/// State of the running simulation.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct LiveStatus {
    pub(crate) paused: bool,
    pub(crate) fell: bool,
    pub(crate) late_s: f64,
    pub(crate) lost_samples: u64,
    pub(crate) problem: Option<String>,
}

/// Handle of the running robot.
pub(crate) struct Live {
    commands: SyncSender<LiveCommand>,
    /// Commands that did not fit into the channel; none is ever dropped.
    waiting: VecDeque<LiveCommand>,
    batches: Receiver<Batch>,
    lost: Arc<AtomicU64>,
    run: u64,
    pub(crate) status: LiveStatus,
}

impl Live {
    /// Starts the thread.
    pub(crate) fn start(waker: &Waker, paused: bool) -> std::io::Result<Self> {
        let (commands, command_receiver) = sync_channel(COMMAND_CAPACITY);
        let (batch_sender, batches) = sync_channel(BATCH_CAPACITY);
        let lost = Arc::new(AtomicU64::new(0));
        let thread = Worker::new(batch_sender, Arc::clone(&lost), Arc::clone(waker), paused);
        std::thread::Builder::new()
            .name("live-robot".to_owned())
            .spawn(move || thread.work(&command_receiver))?;
        let status = LiveStatus { paused, ..LiveStatus::default() };
        Ok(Self { commands, waiting: VecDeque::new(), batches, lost, run: 0, status })
    }

    /// Hands a command over without waiting.
    pub(crate) fn send(&mut self, command: LiveCommand) {
        match &command {
            LiveCommand::Pause(paused) => self.status.paused = *paused,
            LiveCommand::Reset(..) | LiveCommand::Clear => {
                self.run += 1;
                self.status = LiveStatus { paused: self.status.paused, ..LiveStatus::default() };
                self.lost.store(0, Ordering::Relaxed);
            }
            _ => {}
        }
        self.waiting.push_back(command);
        self.flush();
    }

    fn flush(&mut self) {
        while let Some(command) = self.waiting.pop_front() {
            if let Err(TrySendError::Full(command)) = self.commands.try_send(command) {
                self.waiting.push_front(command);
                return;
            }
        }
    }

    /// Samples that have come since the last call.
    pub(crate) fn poll(&mut self) -> Vec<Sample> {
        self.flush();
        let mut samples = Vec::new();
        for batch in self.batches.try_iter().filter(|batch| batch.run == self.run) {
            samples.extend(batch.samples);
            self.status.fell = batch.fell;
            self.status.late_s = batch.late_s;
            self.status.problem = batch.problem;
        }
        self.status.lost_samples = self.lost.load(Ordering::Relaxed);
        samples
    }
}

/// Number of steps due.
struct Clock {
    anchor: Instant,
    done: u64,
}

impl Clock {
    fn start() -> Self {
        Self { anchor: Instant::now(), done: 0 }
    }

    /// Steps to make now, and steps to give up.
    fn due(&mut self, now: Instant) -> (u64, u64) {
        let total = (now.duration_since(self.anchor).as_secs_f64() / TICK_S) as u64;
        let behind = total.saturating_sub(self.done);
        let late = behind.saturating_sub(CATCH_UP_STEPS);
        self.done = total;
        (behind - late, late)
    }
}

/// A simulation and the time at which it began in this run.
struct Plant {
    simulation: Simulation,
    start_s: f64,
}

impl Plant {
    fn new(
        robot: &RobotModel,
        controller: BalanceController,
        initial: Option<State>,
        start_s: f64,
    ) -> Result<Self, String> {
        let mut settings = SimulationSettings::default();
        if let Some(initial) = initial {
            settings.initial = initial;
        }
        let simulation = Simulation::new(robot, controller, settings).map_err(|error| error.to_string())?;
        Ok(Self { simulation, start_s })
    }

    fn time_s(&self) -> f64 {
        self.start_s + self.simulation.time_s()
    }
}

struct Worker {
    batches: SyncSender<Batch>,
    lost: Arc<AtomicU64>,
    waker: Waker,
    plant: Option<Plant>,
    paused: bool,
    fell: bool,
    run: u64,
    interval: Duration,
    clock: Clock,
    late_s: f64,
    pending: Vec<Sample>,
    problem: Option<String>,
}

impl Worker {
    fn new(batches: SyncSender<Batch>, lost: Arc<AtomicU64>, waker: Waker, paused: bool) -> Self {
        Self {
            batches,
            lost,
            waker,
            plant: None,
            paused,
            fell: false,
            run: 0,
            interval: Duration::from_millis(33),
            clock: Clock::start(),
            late_s: 0.0,
            pending: Vec::new(),
            problem: None,
        }
    }

    /// Until the window drops its handle.
    fn work(mut self, commands: &Receiver<LiveCommand>) {
        let mut next_batch = Instant::now();
        loop {
            let received = if self.idle() {
                commands.recv().map_err(|_| RecvTimeoutError::Disconnected)
            } else {
                commands.recv_timeout(next_batch.saturating_duration_since(Instant::now()))
            };
            match received {
                Ok(command) => {
                    if self.apply(command).is_break() {
                        self.report();
                    }
                }
                Err(RecvTimeoutError::Timeout) => {
                    self.advance();
                    self.report();
                    next_batch = Instant::now() + self.interval;
                }
                Err(RecvTimeoutError::Disconnected) => return,
            }
        }
    }

    fn idle(&self) -> bool {
        self.paused || self.fell || self.plant.is_none()
    }

    /// `Break` when the window should hear of it at once.
    fn apply(&mut self, command: LiveCommand) -> ControlFlow<()> {
        // Steps that are due are made with the settings of before.
        if !self.idle() {
            self.advance();
        }
        match command {
            LiveCommand::Controller(controller) => {
                if let Some(plant) = &mut self.plant {
                    plant.simulation.set_controller(controller);
                }
            }
            LiveCommand::Robot(robot, controller) => {
                let state = self.plant.as_ref().map(|plant| plant.simulation.state());
                let time_s = self.plant.as_ref().map_or(0.0, Plant::time_s);
                self.replace(&robot, controller, state, time_s);
            }
            LiveCommand::Reset(robot, controller) => {
                self.clear();
                self.replace(&robot, controller, None, 0.0);
            }
            LiveCommand::Clear => self.clear(),
            LiveCommand::Pause(paused) => self.paused = paused,
            LiveCommand::Push { force_n, duration_s } => {
                if let Some(plant) = &mut self.plant {
                    plant.simulation.push(force_n, duration_s, None);
                }
                return ControlFlow::Continue(());
            }
            LiveCommand::Interval(interval) => self.interval = interval,
        }
        self.clock = Clock::start();
        ControlFlow::Break(())
    }

    /// A new run without a robot.
    fn clear(&mut self) {
        self.run += 1;
        (self.plant, self.fell, self.late_s, self.problem) = (None, false, 0.0, None);
        self.pending.clear();
    }

    fn replace(
        &mut self,
        robot: &RobotModel,
        controller: BalanceController,
        state: Option<State>,
        start_s: f64,
    ) {
        match Plant::new(robot, controller, state, start_s) {
            Ok(plant) => (self.plant, self.problem) = (Some(plant), None),
            // The robot of before goes on, if this run has one.
            Err(problem) => self.problem = Some(problem),
        }
    }

    fn advance(&mut self) {
        let (steps, late) = self.clock.due(Instant::now());
        self.late_s += late as f64 * TICK_S;
        let Some(plant) = &mut self.plant else { return };
        for _ in 0..steps {
            let sample = plant.simulation.step();
            self.pending.push(Sample { time_s: sample.time_s + plant.start_s, ..sample });
            if plant.simulation.has_ended() {
                self.fell = true;
                self.problem = plant.simulation.not_finite().map(ToString::to_string);
                return;
            }
        }
    }

    fn report(&mut self) {
        let samples = std::mem::take(&mut self.pending);
        let count = samples.len() as u64;
        let batch = Batch {
            samples,
            run: self.run,
            fell: self.fell,
            late_s: self.late_s,
            problem: self.problem.clone(),
        };
        match self.batches.try_send(batch) {
            Ok(()) => (self.waker)(),
            // The plot shows a gap, the status line the number.
            Err(_) => {
                self.lost.fetch_add(count, Ordering::Relaxed);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use flqr_core::control::ControllerKind;
    use flqr_core::model_file::presets;

    use super::*;

    fn worker(batches: SyncSender<Batch>) -> Worker {
        Worker::new(batches, Arc::default(), Arc::new(|| {}), false)
    }

    #[test]
    fn nothing_runs_and_no_old_sample_is_left_after_a_clear() {
        let robot = presets::paper().robot().unwrap().clone();
        let gain = nalgebra::Matrix2x4::repeat(-1.0);
        let controller = BalanceController::new(ControllerKind::Lqr, &robot, gain).unwrap();
        let (sender, batches) = sync_channel(4);
        let mut worker = worker(sender);
        assert!(worker.apply(LiveCommand::Reset(Box::new(robot), controller)).is_break());
        assert!(!worker.idle());
        worker.clock.anchor = Instant::now().checked_sub(Duration::from_millis(50)).unwrap();
        worker.advance();
        assert!(!worker.pending.is_empty());
        assert!(worker.apply(LiveCommand::Clear).is_break());
        assert!(worker.idle());
        worker.report();
        let batch = batches.try_recv().unwrap();
        assert_eq!((batch.run, batch.samples.len()), (2, 0));
    }

    #[test]
    fn a_slow_machine_skips_time_instead_of_falling_ever_further_behind() {
        let mut clock = Clock::start();
        let start = clock.anchor;
        assert_eq!(clock.due(start + Duration::from_millis(40)), (40, 0));
        assert_eq!(clock.due(start + Duration::from_millis(40)), (0, 0));
        assert_eq!(clock.due(start + Duration::from_millis(1440)), (CATCH_UP_STEPS, 1000));
        assert_eq!(clock.due(start + Duration::from_millis(1450)), (10, 0));
    }
}
