//! One signal: where it is in a frame and what its bits are worth.

use can_dbc::{ByteOrder, MultiplexIndicator, SignalExtendedValueType, ValueType};

use crate::link::{Frame, FrameKind};

/// A signal of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Signal {
    /// Name.
    pub name: String,
    /// Unit, as the file says.
    pub unit: String,
    place: Place,
    factor: f64,
    offset: f64,
    /// It is in the frame only where all of these multiplexors have one of these values.
    gates: Vec<Gate>,
}

/// Bits of a frame and how they are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    start_bit: u64,
    size: u64,
    order: ByteOrder,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Signed,
    Unsigned,
    Float,
    Double,
}

#[derive(Clone, Debug, PartialEq)]
struct Gate {
    multiplexor: Place,
    ranges: Vec<[u64; 2]>,
}

impl Signal {
    pub(super) fn of(signal: &can_dbc::Signal, message: &can_dbc::Message, file: &can_dbc::Dbc) -> Self {
        Self {
            name: signal.name.clone(),
            unit: signal.unit.clone(),
            place: Place::of(signal, message, file),
            factor: signal.factor,
            offset: signal.offset,
            gates: gates(signal, message, file),
        }
    }

    /// Its value in a frame of its message, in its unit; `None` if the frame is too short or a multiplexor
    /// selects others.
    pub fn value(&self, frame: &Frame) -> Option<f64> {
        if frame.kind() != FrameKind::Data || !self.gates.iter().all(|gate| gate.is_open(frame)) {
            return None;
        }
        let bits = self.place.bits(frame.bytes())?;
        let raw = match self.place.kind {
            Kind::Unsigned => bits as f64,
            Kind::Signed => {
                let unused = 64 - self.place.size;
                ((bits << unused).cast_signed() >> unused) as f64
            }
            Kind::Float => f64::from(f32::from_bits(bits as u32)),
            Kind::Double => f64::from_bits(bits),
        };
        Some(raw * self.factor + self.offset)
    }

    /// Whether a classic frame of 8 bytes can have it.
    pub fn fits(&self) -> bool {
        self.place.bits(&[0; 8]).is_some()
    }
}

impl Gate {
    fn is_open(&self, frame: &Frame) -> bool {
        let value = self.multiplexor.bits(frame.bytes());
        value.is_some_and(|value| self.ranges.iter().any(|[least, most]| (*least..=*most).contains(&value)))
    }
}

/// What has to be selected for a signal to be there: its multiplexor and, if that is selected itself, its
/// multiplexor's.
fn gates(signal: &can_dbc::Signal, message: &can_dbc::Message, file: &can_dbc::Dbc) -> Vec<Gate> {
    let mut gates = Vec::new();
    let mut signal = signal;
    // A file in which multiplexors select each other must not keep us.
    while gates.len() < message.signals.len()
        && let Some((multiplexor, ranges)) = gate(signal, message, file)
    {
        gates.push(Gate { multiplexor: Place::of(multiplexor, message, file), ranges });
        signal = multiplexor;
    }
    gates
}

fn gate<'a>(
    signal: &can_dbc::Signal,
    message: &'a can_dbc::Message,
    file: &can_dbc::Dbc,
) -> Option<(&'a can_dbc::Signal, Vec<[u64; 2]>)> {
    let value = match signal.multiplexer_indicator {
        MultiplexIndicator::MultiplexedSignal(value)
        | MultiplexIndicator::MultiplexorAndMultiplexedSignal(value) => value,
        MultiplexIndicator::Plain | MultiplexIndicator::Multiplexor => return None,
    };
    let extended =
        file.extended_multiplex.iter().find(|m| m.message_id == message.id && m.signal_name == signal.name);
    let by = |is_it: &dyn Fn(&can_dbc::Signal) -> bool| message.signals.iter().find(|signal| is_it(signal));
    match extended {
        Some(extended) => {
            let ranges = extended.mappings.iter().map(|range| [range.min_value, range.max_value]).collect();
            Some((by(&|signal| signal.name == extended.multiplexor_signal_name)?, ranges))
        }
        None => {
            let main = by(&|signal| signal.multiplexer_indicator == MultiplexIndicator::Multiplexor)?;
            Some((main, vec![[value, value]]))
        }
    }
}

impl Place {
    fn of(signal: &can_dbc::Signal, message: &can_dbc::Message, file: &can_dbc::Dbc) -> Self {
        let listed = &file.signal_extended_value_type_list;
        let extended = listed.iter().find(|l| l.message_id == message.id && l.signal_name == signal.name);
        let kind = match (extended.map(|l| l.signal_extended_value_type), signal.value_type) {
            (Some(SignalExtendedValueType::IEEEfloat32Bit), _) if signal.size == 32 => Kind::Float,
            (Some(SignalExtendedValueType::IEEEdouble64bit), _) if signal.size == 64 => Kind::Double,
            (_, ValueType::Signed) => Kind::Signed,
            (_, ValueType::Unsigned) => Kind::Unsigned,
        };
        Self { start_bit: signal.start_bit, size: signal.size, order: signal.byte_order, kind }
    }

    /// The bits as a number; `None` if they are not all there.
    ///
    /// Bit n is bit n % 8, the lowest first, of byte n / 8. A little-endian signal starts with its lowest bit and
    /// goes up; a big-endian one starts with its highest bit and goes down, and on to bit 7 of the next byte.
    fn bits(&self, bytes: &[u8]) -> Option<u64> {
        if !(1..=64).contains(&self.size) || self.start_bit >= 64 {
            return None;
        }
        let mut frame = [0; 8];
        frame.get_mut(..bytes.len())?.copy_from_slice(bytes);
        // The signal's lowest bit, counted from the lowest of a number that has all 64.
        let (number, shift, last_byte) = match self.order {
            ByteOrder::LittleEndian => {
                (u64::from_le_bytes(frame), self.start_bit, (self.start_bit + self.size - 1) / 8)
            }
            ByteOrder::BigEndian => {
                let from_top = self.start_bit / 8 * 8 + (7 - self.start_bit % 8);
                let after = from_top + self.size;
                (u64::from_be_bytes(frame), 64_u64.checked_sub(after)?, (after - 1) / 8)
            }
        };
        let mask = u64::MAX >> (64 - self.size);
        (last_byte < bytes.len() as u64).then_some(number >> shift & mask)
    }
}
