//! Typed reads from the buffers, dense and sparse, with every range checked.

use gltf::json::accessor::{self, ComponentType, Type, sparse::Sparse};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, buffer::View};

use super::{Document, Problem};
use crate::error::ensure;

/// The most elements of an accessor that has no data of its own: its count alone must not exhaust the memory.
pub(super) const MAX_IMPLICIT_ELEMENTS: u64 = 1 << 24;

/// Where elements lie in a buffer view.
struct Range {
    view: Index<View>,
    offset: u64,
    count: u64,
    element_bytes: usize,
}

impl Document<'_> {
    /// Numbers, or vectors of two to four: floats, or 8 and 16-bit integers (texture coordinates, weights, tracks, and
    /// everything under KHR_mesh_quantization).
    pub(super) fn vectors<const N: usize>(&self, index: Index<Accessor>) -> Result<Vec<[f32; N]>, Problem> {
        let (accessor, kind) = self.accessor(index, [Type::Scalar, Type::Vec2, Type::Vec3, Type::Vec4][N - 1])?;
        ensure!(kind != ComponentType::U32, "vertex attributes and tracks cannot be 32-bit integers");
        let normalized = accessor.normalized;
        let size = kind.size();
        let decode = move |bytes: &[u8]| {
            std::array::from_fn(|axis| component(kind, normalized, bytes.get(axis * size..).unwrap_or_default()))
        };
        self.elements(accessor, N * size, [0.0; N], decode)
    }

    /// The joints of vertices.
    pub(super) fn joints(&self, index: Index<Accessor>) -> Result<Vec<[u16; 4]>, Problem> {
        let (accessor, kind) = self.accessor(index, Type::Vec4)?;
        ensure!(
            matches!(kind, ComponentType::U8 | ComponentType::U16),
            "joints have to be 8 or 16-bit unsigned integers"
        );
        let size = kind.size();
        let joint = |bytes: &[u8]| integer(kind, bytes) as u16;
        let decode = |bytes: &[u8]| std::array::from_fn(|k| joint(bytes.get(k * size..).unwrap_or_default()));
        self.elements(accessor, 4 * size, [0; 4], decode)
    }

    /// Affine maps as 4 x 4 matrices of floats: three columns and a translation.
    pub(super) fn affine_matrices(&self, index: Index<Accessor>) -> Result<Vec<[[f32; 3]; 4]>, Problem> {
        let (accessor, kind) = self.accessor(index, Type::Mat4)?;
        ensure!(kind == ComponentType::F32, "matrices have to be floats");
        let decode =
            |bytes: &[u8]| std::array::from_fn(|k| f32::from_le_bytes(first(bytes.get(4 * k..).unwrap_or_default())));
        let matrices = self.elements(accessor, 64, [0.0; 16], decode)?;
        let affine = matrices.iter().position(|m| [m[3], m[7], m[11], m[15]] != [0.0, 0.0, 0.0, 1.0]);
        ensure!(
            affine.is_none(),
            "matrix {} is not affine; its last row has to be 0, 0, 0, 1",
            affine.unwrap_or_default()
        );
        Ok(matrices.iter().map(|m| [0, 4, 8, 12].map(|k| [m[k], m[k + 1], m[k + 2]])).collect())
    }

    /// Unsigned integers.
    pub(super) fn integers(&self, index: Index<Accessor>) -> Result<Vec<u32>, Problem> {
        let (accessor, kind) = self.accessor(index, Type::Scalar)?;
        let unsigned = matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32);
        ensure!(unsigned, "indices have to be unsigned integers");
        self.elements(accessor, kind.size(), 0, move |bytes| integer(kind, bytes))
    }

    /// An accessor of this type, and the type of its components.
    fn accessor(&self, index: Index<Accessor>, expected: Type) -> Result<(&Accessor, ComponentType), Problem> {
        let accessor = self.get(index, "it refers to accessor")?;
        let Checked::Valid(accessor::GenericComponentType(kind)) = accessor.component_type else {
            return Err("an accessor has an unknown component type".to_owned());
        };
        let name = format!("{expected:?}").to_uppercase();
        ensure!(accessor.type_ == Checked::Valid(expected), "an accessor has another type than {name}");
        Ok((accessor, kind))
    }

    fn elements<T: Copy>(
        &self,
        accessor: &Accessor,
        element_bytes: usize,
        zero: T,
        decode: impl Fn(&[u8]) -> T,
    ) -> Result<Vec<T>, Problem> {
        let count = accessor.count.0;
        let mut elements = match accessor.buffer_view {
            Some(view) => {
                let offset = accessor.byte_offset.unwrap_or_default().0;
                self.dense(&Range { view, offset, count, element_bytes }, &decode)?
            }
            None if count > MAX_IMPLICIT_ELEMENTS => {
                return Err(format!(
                    "an accessor without data has {count} elements, more than {MAX_IMPLICIT_ELEMENTS}"
                ));
            }
            None => vec![zero; count as usize],
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(&mut elements, sparse, element_bytes, &decode)?;
        }
        Ok(elements)
    }

    fn substitute<T>(
        &self,
        elements: &mut [T],
        sparse: &Sparse,
        element_bytes: usize,
        decode: &impl Fn(&[u8]) -> T,
    ) -> Result<(), Problem> {
        let (Sparse { indices, values, .. }, count) = (sparse, sparse.count.0);
        let Checked::Valid(accessor::IndexComponentType(kind)) = indices.component_type else {
            return Err("a sparse accessor has indices of an unknown type".to_owned());
        };
        let (view, offset) = (indices.buffer_view, indices.byte_offset.0);
        let indices = self.dense(&Range { view, offset, count, element_bytes: kind.size() }, &|b| integer(kind, b))?;
        let (view, offset) = (values.buffer_view, values.byte_offset.0);
        let values = self.dense(&Range { view, offset, count, element_bytes }, decode)?;
        let length = elements.len();
        for (index, value) in indices.into_iter().zip(values) {
            let replaced = elements.get_mut(index as usize);
            *replaced.ok_or_else(|| format!("a sparse accessor of {length} elements replaces element {index}"))? =
                value;
        }
        Ok(())
    }

    fn dense<T>(&self, range: &Range, decode: &impl Fn(&[u8]) -> T) -> Result<Vec<T>, Problem> {
        let (view, stride) = self.view(range.view)?;
        let stride = stride.unwrap_or(range.element_bytes);
        let size = range.element_bytes;
        ensure!(stride >= size, "elements of {size} bytes overlap at a stride of {stride}");
        if range.count == 0 {
            return Ok(Vec::new());
        }
        let bytes = covered(range, stride).and_then(|covered| view.get(covered)).ok_or_else(|| {
            format!("an accessor of {} elements reaches beyond its buffer view of {} bytes", range.count, view.len())
        })?;
        // The last chunk may be shorter than the stride.
        Ok(bytes.chunks(stride).map(|chunk| decode(chunk.get(..size).unwrap_or(chunk))).collect())
    }

    pub(super) fn view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>), Problem> {
        let view = self.get(index, "it refers to buffer view")?;
        self.get(view.buffer, "it refers to buffer")?;
        let buffer = &self.buffers[view.buffer.value()];
        let (start, length) = (view.byte_offset.unwrap_or_default().0, view.byte_length.0);
        let cut = || buffer.get(usize::try_from(start).ok()?..)?.get(..usize::try_from(length).ok()?);
        let beyond = || format!("buffer view {index} reaches beyond its buffer of {} bytes", buffer.len());
        Ok((cut().ok_or_else(beyond)?, view.byte_stride.as_ref().map(|stride| stride.0)))
    }
}

/// From the first byte of the first element to the end of the last; the count is not zero.
fn covered(range: &Range, stride: usize) -> Option<std::ops::Range<usize>> {
    let start = usize::try_from(range.offset).ok()?;
    let steps = usize::try_from(range.count).ok()?.checked_sub(1)?.checked_mul(stride)?;
    Some(start..start.checked_add(steps)?.checked_add(range.element_bytes)?)
}

fn component(kind: ComponentType, normalized: bool, bytes: &[u8]) -> f32 {
    let (value, largest) = match kind {
        ComponentType::F32 => return f32::from_le_bytes(first(bytes)),
        ComponentType::I8 => (f32::from(i8::from_le_bytes(first(bytes))), 127.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes(first(bytes))), 32767.0),
        ComponentType::U8 => (f32::from(u8::from_le_bytes(first(bytes))), 255.0),
        ComponentType::U16 | ComponentType::U32 => (f32::from(u16::from_le_bytes(first(bytes))), 65535.0),
    };
    if normalized { (value / largest).max(-1.0) } else { value }
}

fn integer(kind: ComponentType, bytes: &[u8]) -> u32 {
    match kind {
        ComponentType::U8 => u32::from(u8::from_le_bytes(first(bytes))),
        ComponentType::U16 => u32::from(u16::from_le_bytes(first(bytes))),
        _ => u32::from_le_bytes(first(bytes)),
    }
}

/// The first `N` bytes; the caller gives as many.
fn first<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}
