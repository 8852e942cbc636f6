//! Protobuf messages declared once: the macro makes the Rust type and the descriptor that readers decode it with.
//!
//! A recording carries the schema of every topic as a protobuf `FileDescriptorSet`. It is usually made by `protoc` from
//! `.proto` files; here [`message!`] makes it from the same lines as the `prost` type, so that the two cannot disagree.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto, FileDescriptorProto,
    FileDescriptorSet,
};

/// The `.proto` files that a message needs, each after those that it depends on.
#[derive(Default)]
pub(crate) struct Files {
    set: FileDescriptorSet,
    begun: Vec<&'static str>,
}

/// A message that knows its own `.proto` file; every message has a file of its own, as foxglove's have.
pub(crate) trait Described {
    /// Path of the file, such as `foxglove/Color.proto`; its folders are the package.
    const FILE: &'static str;
    /// Name without the package.
    const NAME: &'static str;

    /// Adds the fields, and the files of the messages in them.
    fn fields(files: &mut Files, draft: &mut Draft);

    /// Adds the message's file, after those that it depends on.
    fn describe(files: &mut Files)
    where
        Self: Sized,
    {
        if files.begin(Self::FILE) {
            let mut draft = Draft::new::<Self>();
            Self::fields(files, &mut draft);
            files.add(Self::FILE, draft);
        }
    }

    /// Name with the package, such as `foxglove.Color`.
    fn full_name() -> String {
        format!("{}.{}", package(Self::FILE), Self::NAME)
    }

    /// The encoded `FileDescriptorSet` that a reader decodes the message with.
    fn schema() -> Vec<u8>
    where
        Self: Sized,
    {
        let mut files = Files::default();
        Self::describe(&mut files);
        files.set.encode_to_vec()
    }
}

/// An enumeration inside a message.
pub(crate) trait DescribedEnum {
    /// Name inside the message that it belongs to.
    const NAME: &'static str;

    /// Names and numbers of the values.
    fn values() -> &'static [(&'static str, i32)];
}

/// What the Rust type of a field tells about it: a message's name, or nothing.
pub(crate) trait FieldType {
    /// Describes the message, when it is one, and gives its file and full name.
    fn message(files: &mut Files) -> Option<(&'static str, String)> {
        let _ = files;
        None
    }
}

impl FieldType for f64 {}
impl FieldType for bool {}
impl FieldType for u8 {}
impl FieldType for u32 {}
impl FieldType for i32 {}
impl FieldType for i64 {}
impl FieldType for String {}

impl<T: FieldType> FieldType for Vec<T> {
    fn message(files: &mut Files) -> Option<(&'static str, String)> {
        T::message(files)
    }
}

impl<T: FieldType> FieldType for Option<T> {
    fn message(files: &mut Files) -> Option<(&'static str, String)> {
        T::message(files)
    }
}

/// The package of a file: its folders.
fn package(file: &str) -> String {
    file.rsplit_once('/').map_or_else(String::new, |(folders, _)| folders.replace('/', "."))
}

impl Files {
    /// Whether the file still has to be described; it counts as described from then on.
    pub(crate) fn begin(&mut self, file: &'static str) -> bool {
        let new = !self.begun.contains(&file);
        if new {
            self.begun.push(file);
        }
        new
    }

    /// Adds a file with one message.
    pub(crate) fn add(&mut self, file: &str, draft: Draft) {
        self.set.file.push(FileDescriptorProto {
            name: Some(file.to_owned()),
            package: Some(package(file)),
            dependency: draft.dependencies,
            message_type: vec![draft.message],
            syntax: Some("proto3".to_owned()),
            ..FileDescriptorProto::default()
        });
    }
}

/// A message's descriptor in the making.
pub(crate) struct Draft {
    full_name: String,
    message: DescriptorProto,
    dependencies: Vec<String>,
}

impl Draft {
    pub(crate) fn new<M: Described>() -> Self {
        let message = DescriptorProto { name: Some(M::NAME.to_owned()), ..DescriptorProto::default() };
        Self { full_name: M::full_name(), message, dependencies: Vec::new() }
    }

    /// Adds an enumeration.
    pub(crate) fn enumeration<E: DescribedEnum>(&mut self) {
        self.message.enum_type.push(EnumDescriptorProto {
            name: Some(E::NAME.to_owned()),
            value: E::values()
                .iter()
                .map(|(name, number)| EnumValueDescriptorProto {
                    name: Some((*name).to_owned()),
                    number: Some(*number),
                    options: None,
                })
                .collect(),
            ..EnumDescriptorProto::default()
        });
    }

    /// Adds a field: `name` as Rust spells it, `attributes` as prost takes them, the enumeration where it is one.
    pub(crate) fn field<T: FieldType>(
        &mut self,
        files: &mut Files,
        (name, number): (&str, i32),
        attributes: &str,
        enumeration: Option<&str>,
    ) {
        let message = T::message(files);
        let type_name = message
            .as_ref()
            .map(|(_, name)| format!(".{name}"))
            .or_else(|| enumeration.map(|name| format!(".{}.{name}", self.full_name)));
        if let Some((file, _)) = message
            && !self.dependencies.iter().any(|known| known == file)
        {
            self.dependencies.push(file.to_owned());
            self.dependencies.sort();
        }
        let words = || attributes.split([',', '(', ' ']);
        let kind = match words().next() {
            Some("double") => Type::Double,
            Some("bool") => Type::Bool,
            Some("int32") => Type::Int32,
            Some("int64") => Type::Int64,
            Some("fixed32") => Type::Fixed32,
            Some("bytes") => Type::Bytes,
            Some("enumeration") => Type::Enum,
            Some("message") => Type::Message,
            _ => Type::String,
        };
        let label = if words().any(|word| word == "repeated") { Label::Repeated } else { Label::Optional };
        self.message.field.push(FieldDescriptorProto {
            name: Some(name.trim_start_matches("r#").to_owned()),
            number: Some(number),
            label: Some(label.into()),
            r#type: Some(kind.into()),
            type_name,
            ..FieldDescriptorProto::default()
        });
    }
}

/// Declares a message: its `.proto` file, then the struct with `tag => [prost's attributes] name: type`.
///
/// `required` makes prost write a field even where it is zero: a message of numbers then always has the same size, and a
/// negative zero survives. On the wire and in the schema it is an ordinary field.
macro_rules! message {
    (
        $file:literal
        $(#[$meta:meta])*
        $vis:vis struct $name:ident $(with $($inner:ident)+)? {
            $($(#[$field_meta:meta])* $tag:literal => [$kind:ident $(($enumeration:ident))? $(, $label:ident)*] $field:ident: $type:ty,)*
        }
    ) => {
        $(#[$meta])*
        #[derive(Clone, PartialEq, ::prost::Message)]
        $vis struct $name {
            $(
                $(#[$field_meta])*
                #[prost($kind $(($enumeration))? $(, $label)*, tag($tag))]
                $vis $field: $type,
            )*
        }

        impl $crate::recording::schema::Described for $name {
            const FILE: &'static str = $file;
            const NAME: &'static str = stringify!($name);

            fn fields(files: &mut $crate::recording::schema::Files, draft: &mut $crate::recording::schema::Draft) {
                $($(draft.enumeration::<$inner>();)+)?
                $(
                    let enumeration = None$(.or(Some(<$enumeration as $crate::recording::schema::DescribedEnum>::NAME)))?;
                    draft.field::<$type>(files, (stringify!($field), $tag), stringify!($kind $(, $label)*), enumeration);
                )*
            }
        }

        impl $crate::recording::schema::FieldType for $name {
            fn message(files: &mut $crate::recording::schema::Files) -> Option<(&'static str, String)> {
                use $crate::recording::schema::Described;
                Self::describe(files);
                Some((Self::FILE, Self::full_name()))
            }
        }
    };
}

/// A field, or a message of such fields, that always has the same length: it is written three times as fast as by prost.
pub(crate) trait Fixed {
    /// Its wire type.
    const WIRE: u8;
    /// Bytes after the tag.
    const BYTES: usize;

    /// Writes it at `at` and gives the place behind it. Room for it is the caller's: what does not fit is left out.
    fn put(&self, out: &mut [u8], at: usize) -> usize;
}

impl Fixed for f64 {
    const WIRE: u8 = 1;
    const BYTES: usize = 8;

    #[inline]
    fn put(&self, out: &mut [u8], at: usize) -> usize {
        put_bytes(out, at, self.to_le_bytes())
    }
}

impl Fixed for bool {
    const WIRE: u8 = 0;
    const BYTES: usize = 1;

    #[inline]
    fn put(&self, out: &mut [u8], at: usize) -> usize {
        put_bytes(out, at, [u8::from(*self)])
    }
}

#[inline]
pub(crate) fn put_bytes<const N: usize>(out: &mut [u8], at: usize, bytes: [u8; N]) -> usize {
    if let Some(place) = out.get_mut(at..at + N) {
        place.copy_from_slice(&bytes);
    }
    at + N
}

/// As [`message!`], for messages of numbers, flags and other such messages, all `required`, with tags below 16 and less
/// than 128 bytes in an inner one; they are [`Fixed`] too.
macro_rules! fixed_message {
    (
        $file:literal
        $(#[$meta:meta])*
        $vis:vis struct $name:ident {
            $($(#[$field_meta:meta])* $tag:literal => [$kind:ident] $field:ident: $type:ty,)*
        }
    ) => {
        $crate::recording::schema::message! {
            $file
            $(#[$meta])*
            #[derive(Copy)]
            $vis struct $name { $($(#[$field_meta])* $tag => [$kind, required] $field: $type,)* }
        }

        impl $name {
            /// Bytes of the message itself.
            pub(crate) const LENGTH: usize = 0 $(+ 1 + <$type as $crate::recording::schema::Fixed>::BYTES)*;

            /// Writes the message itself.
            #[inline]
            pub(crate) fn put_fields(&self, out: &mut [u8], mut at: usize) -> usize {
                use $crate::recording::schema::{Fixed, put_bytes};
                $(
                    at = put_bytes(out, at, [($tag << 3) | <$type as Fixed>::WIRE]);
                    at = self.$field.put(out, at);
                )*
                at
            }
        }

        impl $crate::recording::schema::Fixed for $name {
            const WIRE: u8 = 2;
            const BYTES: usize = 1 + Self::LENGTH;

            #[inline]
            #[allow(clippy::cast_possible_truncation)] // below 128, see above
            fn put(&self, out: &mut [u8], at: usize) -> usize {
                let at = $crate::recording::schema::put_bytes(out, at, [Self::LENGTH as u8]);
                self.put_fields(out, at)
            }
        }
    };
}

/// Declares an enumeration of a message: its name there, then each value with its name there.
macro_rules! enumeration {
    (
        $name:literal
        $(#[$meta:meta])*
        $vis:vis enum $enum:ident { $($value:ident = $number:literal $text:literal,)+ }
    ) => {
        $(#[$meta])*
        #[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, ::prost::Enumeration)]
        #[repr(i32)]
        $vis enum $enum { $($value = $number,)+ }

        impl $crate::recording::schema::DescribedEnum for $enum {
            const NAME: &'static str = $name;

            fn values() -> &'static [(&'static str, i32)] {
                &[$(($text, $number),)+]
            }
        }
    };
}

pub(crate) use {enumeration, fixed_message, message};
