//! Protocol buffers, as far as an MCAP file needs them: messages of plain fields, and their description.
//!
//! Source: "Encoding" of protobuf.dev and `descriptor.proto`, whose field numbers these are.

/// A message on its way to bytes.
#[derive(Clone, Debug, Default)]
pub(super) struct Message(Vec<u8>);

impl Message {
    pub(super) fn bytes(&self) -> &[u8] {
        &self.0
    }

    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    pub(super) fn push_uint(&mut self, field: u32, value: u64) {
        self.push_varint(u64::from(field << 3));
        self.push_varint(value);
    }

    pub(super) fn push_double(&mut self, field: u32, value: f64) {
        self.push_varint(u64::from(field << 3 | 1));
        self.0.extend_from_slice(&value.to_le_bytes());
    }

    pub(super) fn push_bytes(&mut self, field: u32, value: &[u8]) {
        self.push_varint(u64::from(field << 3 | 2));
        self.push_varint(value.len() as u64);
        self.0.extend_from_slice(value);
    }

    fn push_varint(&mut self, mut value: u64) {
        while value >= 0x80 {
            self.0.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.0.push(value as u8);
    }

    fn uint(mut self, field: u32, value: u64) -> Self {
        self.push_uint(field, value);
        self
    }

    fn text(mut self, field: u32, value: &str) -> Self {
        self.push_bytes(field, value.as_bytes());
        self
    }

    fn message(mut self, field: u32, value: &Self) -> Self {
        self.push_bytes(field, &value.0);
        self
    }
}

/// Type of a field.
#[derive(Clone, Copy, Debug)]
pub(super) enum Kind {
    Double,
    Uint,
    Int32,
    Int64,
    Fixed32,
    Bool,
    Text,
    Bytes,
    /// An enumeration of the same file, by its full name.
    Enum(&'static str),
    /// Another message, by its full name.
    Message(&'static str),
}

impl Kind {
    /// `FieldDescriptorProto.Type`.
    fn code(self) -> u64 {
        match self {
            Self::Double => 1,
            Self::Uint => 13,
            Self::Int32 => 5,
            Self::Int64 => 3,
            Self::Fixed32 => 7,
            Self::Bool => 8,
            Self::Text => 9,
            Self::Bytes => 12,
            Self::Enum(_) => 14,
            Self::Message(_) => 11,
        }
    }
}

/// A message type: its fields are numbered from 1 on.
pub(super) struct MessageType<'a> {
    pub(super) name: &'a str,
    pub(super) fields: &'a [(&'a str, Kind)],
    /// An enumeration inside it: name and values from 0 on.
    pub(super) values: Option<(&'a str, &'a [&'a str])>,
}

impl MessageType<'_> {
    /// `DescriptorProto`.
    fn descriptor(&self) -> Message {
        let mut message = Message::default().text(1, self.name);
        for (index, (name, kind)) in self.fields.iter().enumerate() {
            const OPTIONAL: u64 = 1;
            let field = Message::default().text(1, name).uint(3, index as u64 + 1);
            let mut field = field.uint(4, OPTIONAL).uint(5, kind.code());
            if let Kind::Enum(name) | Kind::Message(name) = kind {
                field = field.text(6, name);
            }
            message = message.message(2, &field);
        }
        if let Some((name, values)) = self.values {
            let values =
                values.iter().enumerate().fold(Message::default().text(1, name), |all, (number, value)| {
                    all.message(2, &Message::default().text(1, value).uint(2, number as u64))
                });
            message = message.message(4, &values);
        }
        message
    }
}

/// A file with one message type, `FileDescriptorProto`.
pub(super) struct File<'a> {
    pub(super) name: &'a str,
    pub(super) package: &'a str,
    pub(super) imports: &'a [&'a str],
    pub(super) message: MessageType<'a>,
}

/// The `FileDescriptorSet` of these files, which is the schema of a channel.
pub(super) fn descriptor_set(files: &[File]) -> Vec<u8> {
    let mut set = Message::default();
    for file in files {
        let mut descriptor = Message::default().text(1, file.name).text(2, file.package);
        descriptor = file.imports.iter().fold(descriptor, |all, import| all.text(3, import));
        descriptor = descriptor.message(4, &file.message.descriptor()).text(12, "proto3");
        set = set.message(1, &descriptor);
    }
    set.0
}
