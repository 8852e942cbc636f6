//! The records of an MCAP file that a recording needs, taken apart without trusting a single length in them.
//!
//! (The `mcap` crate's own parser panics on a damaged attachment.) Source: <https://mcap.dev/spec>, "Records".

use std::collections::BTreeMap;

/// The bytes of a record that have not been taken yet.
pub(crate) struct Fields<'a> {
    rest: &'a [u8],
}

impl<'a> Fields<'a> {
    pub(crate) fn new(data: &'a [u8]) -> Self {
        Self { rest: data }
    }

    fn take(&mut self, length: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.rest.split_at_checked(length)?;
        self.rest = rest;
        Some(taken)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    fn u32(&mut self) -> Option<usize> {
        usize::try_from(u32::from_le_bytes(self.array()?)).ok()
    }

    fn u64(&mut self) -> Option<usize> {
        usize::try_from(u64::from_le_bytes(self.array()?)).ok()
    }

    fn string(&mut self) -> Option<&'a str> {
        let length = self.u32()?;
        std::str::from_utf8(self.take(length)?).ok()
    }

    fn map(&mut self) -> Option<BTreeMap<String, String>> {
        let length = self.u32()?;
        let mut inner = Self { rest: self.take(length)? };
        let mut map = BTreeMap::new();
        while !inner.rest.is_empty() {
            let key = inner.string()?.to_owned();
            map.insert(key, inner.string()?.to_owned());
        }
        Some(map)
    }
}

/// A channel: one topic.
pub(crate) struct Channel<'a> {
    pub(crate) id: u16,
    pub(crate) schema_id: u16,
    pub(crate) topic: &'a str,
    pub(crate) message_encoding: &'a str,
}

/// The library that wrote the file.
pub(crate) fn header<'a>(fields: &mut Fields<'a>) -> Option<&'a str> {
    let _profile = fields.string()?;
    fields.string()
}

/// Number and name of a schema.
pub(crate) fn schema<'a>(fields: &mut Fields<'a>) -> Option<(u16, &'a str)> {
    Some((fields.u16()?, fields.string()?))
}

/// A channel.
pub(crate) fn channel<'a>(fields: &mut Fields<'a>) -> Option<Channel<'a>> {
    Some(Channel {
        id: fields.u16()?,
        schema_id: fields.u16()?,
        topic: fields.string()?,
        message_encoding: fields.string()?,
    })
}

/// Channel and body of a message.
pub(crate) fn message<'a>(fields: &mut Fields<'a>) -> Option<(u16, &'a [u8])> {
    let channel = fields.u16()?;
    // Sequence, log time, publish time.
    fields.take(4 + 8 + 8)?;
    Some((channel, fields.rest))
}

/// Name and pairs of a metadata record.
pub(crate) fn metadata<'a>(fields: &mut Fields<'a>) -> Option<(&'a str, BTreeMap<String, String>)> {
    Some((fields.string()?, fields.map()?))
}

/// Name, media type and data of an attachment.
pub(crate) fn attachment<'a>(fields: &mut Fields<'a>) -> Option<(&'a str, &'a str, &'a [u8])> {
    // Log time, creation time.
    fields.take(8 + 8)?;
    let name = fields.string()?;
    let media_type = fields.string()?;
    let length = fields.u64()?;
    let data = fields.take(length)?;
    // The checksum; the whole file has one too, which is checked.
    fields.take(4)?;
    Some((name, media_type, data))
}
