//! Addresses of samples in ascending order, as deletes and trims name them: rows skipped, then the column or the columns
//! skipped within the row, each as a variable-length number.

use super::CodecError;
use super::pack::{Packer, Unpacker};
use crate::bytes::{Reader, Writer};
use crate::limits::Limits;

/// Appends addresses, which ascend row by row. Out of order, they come back different; the held copy refuses them anyway.
pub(crate) fn write_addresses(addresses: impl Iterator<Item = (u16, u16)>, packer: &mut Packer, out: &mut Writer) {
    let mut gaps = Writer::default();
    let (mut count, mut next, mut row) = (0, 0, 0);
    for (x, y) in addresses {
        if y != row {
            next = 0;
        }
        gaps.varint(u32::from(y.wrapping_sub(row)));
        gaps.varint(u32::from(x.wrapping_sub(next)));
        (next, row) = (x.wrapping_add(1), y);
        count += 1;
    }
    out.u32(count);
    out.u32(u32::try_from(gaps.bytes.len()).expect("six bytes an address at most"));
    packer.pack(&gaps.bytes, out);
}

/// Reads what [`write_addresses`] wrote.
pub(crate) fn read_addresses(
    bytes: &mut Reader,
    unpacker: &mut Unpacker,
    limits: &Limits,
) -> Result<Vec<(u16, u16)>, CodecError> {
    let (count, length) = (bytes.u32()? as usize, bytes.u32()? as usize);
    if count > limits.update_samples {
        return Err(CodecError::TooMuch("addresses"));
    }
    // Two numbers of one to three bytes each.
    if length < count * 2 || length > count * 6 {
        return Err(CodecError::Damaged("addresses"));
    }
    let gaps = unpacker.unpack(bytes, length)?;
    let mut gaps = Reader::new(&gaps);
    let (mut next, mut row) = (0_u16, 0_u16);
    let address = |_| {
        let (rows, columns) = (gaps.varint()? as u16, gaps.varint()? as u16);
        if rows > 0 {
            next = 0;
        }
        row = row.wrapping_add(rows);
        let x = next.wrapping_add(columns);
        next = x.wrapping_add(1);
        Ok((x, row))
    };
    (0..count).map(address).collect()
}
