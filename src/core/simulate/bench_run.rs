//! Runs of two motors with their wheels in the air, or of one shaft on a bench.

use std::ops::ControlFlow;

use super::bench_plant::BenchPlant;
use super::motors::Motors;
use super::sensors::Sensors;
use super::simulation::{NotFinite, SENSOR_STREAM, SimulationSettings, TICK_S};
use super::statistics::{Summary, between, summary};
use super::tracking::StepResponse;
use crate::control::{SpeedPi, SpeedProgram, SpeedRun};
use crate::effects::{EffectFeedforward, EffectLaw, Machine, MotionSample};
use crate::friction::{Compensation, Stribeck};
use crate::model::{
    Actuation, AxisModel, AxisParameters, Effect, Motor, MotorLimits, RobotModel, SensorSettings,
};
use crate::record::{BenchSample, Readings};

/// Outcome of a run in the air.
#[derive(Clone, Debug, PartialEq)]
pub struct BenchRun {
    /// Recording, one row every 1 ms from 0, until the end or a stop by the watcher.
    pub samples: Vec<BenchSample>,
    /// Step responses of both motors; `None` without a step.
    pub tracking: Option<[StepResponse; 2]>,
    /// Warnings known before the run.
    pub warnings: Vec<String>,
    /// Step at which the motion became non-finite, if any; the samples end there.
    pub(super) not_finite: Option<NotFinite>,
}

impl BenchRun {
    /// Statistics of one motor's measured speed, rad/s, and torque, N m, over the whole run.
    pub fn statistics(&self, motor: Motor) -> [Summary; 2] {
        Self::statistics_of(&self.samples, motor)
    }

    /// Statistics between two times, inclusive; `None` without samples between them.
    pub fn statistics_between(&self, motor: Motor, range_s: [f64; 2]) -> Option<[Summary; 2]> {
        let counted = between(&self.samples, |sample| sample.time_s, range_s);
        (!counted.is_empty()).then(|| Self::statistics_of(counted, motor))
    }

    fn statistics_of(samples: &[BenchSample], motor: Motor) -> [Summary; 2] {
        let motor = motor as usize;
        [
            summary(samples, |sample| sample.motor_speed_rad_s[motor]),
            summary(samples, |sample| sample.torque_nm[motor]),
        ]
    }
}

/// A motor with its wheel in the air, its command line and its sensors.
#[derive(Clone, Debug)]
pub(super) struct BenchRig {
    pub(super) inertia_kg_m2: f64,
    gravity_torque_nm: f64,
    pub(super) friction: [Option<Stribeck>; 2],
    limits: MotorLimits,
    pub(super) actuation: Actuation,
    sensors: SensorSettings,
    machine: Machine,
    pub(super) effects: Vec<Effect>,
    /// One shaft in place of two.
    single: bool,
}

impl BenchRig {
    /// From a speed to the torque that answers it, s: the delay, and the mean age of a held reading.
    pub(super) fn loop_delay_s(&self) -> f64 {
        self.actuation.delay_s + self.sensors.mean_motor_age_s()
    }

    /// Both wheels of a robot.
    pub(super) fn of_robot(robot: &RobotModel) -> Self {
        let robot = robot.with_effects_declared();
        Self {
            inertia_kg_m2: robot.parameters.wheel_inertia_kg_m2,
            gravity_torque_nm: 0.0,
            friction: robot.friction,
            limits: robot.limits,
            actuation: robot.actuation,
            sensors: robot.sensors,
            machine: Machine::wheel_in_air(&robot),
            effects: robot.effects,
            single: false,
        }
    }

    /// A rotary axis; none for a carriage.
    pub(super) fn of_axis(axis: &AxisModel) -> Option<Self> {
        let axis = axis.with_effects_declared();
        let AxisParameters::Rotary { inertia_kg_m2, gravity_torque_nm, friction } = axis.parameters else {
            return None;
        };
        Some(Self {
            inertia_kg_m2,
            gravity_torque_nm,
            friction: [friction; 2],
            limits: MotorLimits::default(),
            actuation: Actuation::default(),
            sensors: SensorSettings::default(),
            machine: Machine::axis(&axis),
            effects: axis.effects,
            single: true,
        })
    }

    /// Laws of the effects on one of the shafts.
    fn laws(&self, motor: Motor) -> Vec<EffectLaw> {
        let own = self.effects.iter().filter(|effect| self.single || effect.is_in(motor));
        own.map(|effect| effect.law(&self.machine)).collect()
    }

    /// Feedforward of its effects.
    pub(super) fn feedforward(&self, compensation: Compensation) -> Option<EffectFeedforward> {
        EffectFeedforward::new(&self.machine, &self.effects, compensation)
    }

    pub(super) fn torque_limit_nm(&self) -> f64 {
        self.limits.torque_nm.unwrap_or(f64::INFINITY)
    }
}

/// Both motors in motion.
struct Bench<'a> {
    rig: &'a BenchRig,
    control: SpeedRun,
    fed: Option<EffectFeedforward>,
    shafts: [BenchPlant; 2],
    motors: Motors,
    sensors: Sensors,
}

/// Runs a program for `ticks` under the speed control, with effects fed forward or not; `watch` hears the share that
/// is done.
pub(super) fn run(
    rig: &BenchRig,
    control: &[SpeedPi; 2],
    fed: Option<EffectFeedforward>,
    program: &SpeedProgram,
    ticks: usize,
    seed: u64,
    watch: &mut dyn FnMut(f64) -> ControlFlow<()>,
) -> BenchRun {
    let mut bench = Bench::new(rig, SpeedRun::new(*control, program.clone()), fed, seed);
    let mut samples: Vec<BenchSample> = Vec::with_capacity(ticks);
    let mut not_finite = None;
    for tick in 0..ticks {
        if tick.is_multiple_of(10) && watch(tick as f64 / ticks as f64).is_break() && tick > 0 {
            break;
        }
        samples.push(bench.step(tick as u64));
        if !bench.shafts.iter().all(BenchPlant::is_finite) {
            let step = tick as u64 + 1;
            not_finite = Some(NotFinite { step, time_s: step as f64 / 1000.0 });
            break;
        }
    }
    let tracking = match program {
        SpeedProgram::Step(step) => Some([0, 1].map(|motor| StepResponse::of(&samples, motor, step))),
        _ => None,
    };
    BenchRun { samples, tracking, warnings: Vec::new(), not_finite }
}

impl<'a> Bench<'a> {
    fn new(rig: &'a BenchRig, control: SpeedRun, fed: Option<EffectFeedforward>, seed: u64) -> Self {
        let shaft = |motor: usize| {
            BenchPlant::new(rig.inertia_kg_m2, rig.gravity_torque_nm, rig.friction[motor], 0.0, 0.0)
                .with_effects(rig.laws(Motor::BOTH[motor]))
        };
        Self {
            rig,
            control,
            fed,
            shafts: [0, 1].map(shaft),
            motors: Motors::new(&rig.limits, &rig.actuation, seed),
            sensors: Sensors::new(rig.sensors, seed, SENSOR_STREAM),
        }
    }

    /// One tick: read, control, move on by 1 ms.
    fn step(&mut self, tick: u64) -> BenchSample {
        let time_s = tick as f64 / 1000.0;
        let truth = Readings {
            motor_angle_rad: self.shafts.each_ref().map(BenchPlant::angle_rad),
            motor_speed_rad_s: self.shafts.each_ref().map(BenchPlant::speed_rad_s),
            ..Readings::default()
        };
        let readings = self.sensors.read(&truth, tick);
        let target_speed_rad_s = self.control.target_rad_s(time_s);
        let torque_nm = self.control.step(time_s, readings.motor_speed_rad_s);
        let torque_nm = self.with_effects(&readings, torque_nm);
        self.advance(torque_nm);
        let mut sample = BenchSample {
            time_s: self.sensors.stamp(tick),
            motor_angle_rad: readings.motor_angle_rad,
            motor_speed_rad_s: readings.motor_speed_rad_s,
            torque_nm,
            target_speed_rad_s,
        };
        if self.rig.single {
            let once = |pair: &mut [f64; 2]| pair[1] = pair[0];
            once(&mut sample.motor_angle_rad);
            once(&mut sample.motor_speed_rad_s);
            once(&mut sample.torque_nm);
        }
        sample
    }

    /// Returns the commands that give the desired torques.
    fn with_effects(&self, readings: &Readings, torque_nm: [f64; 2]) -> [f64; 2] {
        let Some(fed) = &self.fed else { return torque_nm };
        let limit_nm = self.rig.torque_limit_nm();
        Motor::BOTH.map(|motor| {
            let index = motor as usize;
            let moment = MotionSample {
                motor_angle_rad: readings.motor_angle_rad[index],
                motor_speed_rad_s: readings.motor_speed_rad_s[index],
                ..MotionSample::default()
            };
            fed.asked_nm(motor, &moment, torque_nm[index]).clamp(-limit_nm, limit_nm)
        })
    }

    fn advance(&mut self, asked_nm: [f64; 2]) {
        let speeds = self.shafts.each_ref().map(BenchPlant::speed_rad_s);
        for (shaft, torque_nm) in self.shafts.iter_mut().zip(self.motors.step(asked_nm, speeds)) {
            shaft.advance(torque_nm, TICK_S, SimulationSettings::default().substeps);
        }
    }
}
