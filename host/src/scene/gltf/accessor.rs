//! Typed reads from the buffers, dense and sparse, with every range checked.

use gltf::json::accessor::{self, ComponentType, Type};
use gltf::json::validation::Checked;
use gltf::json::{Accessor, Index, buffer::View};

use super::{Document, Problem};

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
    /// Vectors of two to four components: floats, or 8 and 16-bit integers (texture coordinates, and everything under
    /// KHR_mesh_quantization).
    pub(super) fn vectors<const N: usize>(&self, index: Index<Accessor>) -> Result<Vec<[f32; N]>, Problem> {
        let accessor = self.accessor(index)?;
        let kind = component_type(accessor)?;
        let (type_, name) = match N {
            2 => (Type::Vec2, "VEC2"),
            3 => (Type::Vec3, "VEC3"),
            _ => (Type::Vec4, "VEC4"),
        };
        check_type(accessor, type_, name)?;
        if kind == ComponentType::U32 {
            return Err("vertex attributes cannot be 32-bit integers".to_owned());
        }
        let normalized = accessor.normalized;
        let size = kind.size();
        let decode = move |bytes: &[u8]| {
            std::array::from_fn(|axis| component(kind, normalized, bytes.get(axis * size..).unwrap_or_default()))
        };
        self.elements(accessor, N * size, [0.0; N], decode)
    }

    /// Unsigned integers.
    pub(super) fn integers(&self, index: Index<Accessor>) -> Result<Vec<u32>, Problem> {
        let accessor = self.accessor(index)?;
        let kind = component_type(accessor)?;
        check_type(accessor, Type::Scalar, "SCALAR")?;
        if !matches!(kind, ComponentType::U8 | ComponentType::U16 | ComponentType::U32) {
            return Err("indices have to be unsigned integers".to_owned());
        }
        self.elements(accessor, kind.size(), 0, move |bytes| integer(kind, bytes))
    }

    fn accessor(&self, index: Index<Accessor>) -> Result<&Accessor, Problem> {
        let index = index.value();
        self.root.accessors.get(index).ok_or_else(|| format!("it refers to accessor {index}, which does not exist"))
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
            None if count <= MAX_IMPLICIT_ELEMENTS => vec![zero; count as usize],
            None => {
                return Err(format!(
                    "an accessor without data has {count} elements, more than {MAX_IMPLICIT_ELEMENTS}"
                ));
            }
        };
        if let Some(sparse) = &accessor.sparse {
            self.substitute(&mut elements, sparse, element_bytes, &decode)?;
        }
        Ok(elements)
    }

    fn substitute<T>(
        &self,
        elements: &mut [T],
        sparse: &accessor::sparse::Sparse,
        element_bytes: usize,
        decode: &impl Fn(&[u8]) -> T,
    ) -> Result<(), Problem> {
        let count = sparse.count.0;
        let Checked::Valid(accessor::IndexComponentType(kind)) = sparse.indices.component_type else {
            return Err("a sparse accessor has indices of an unknown type".to_owned());
        };
        let indices = Range {
            view: sparse.indices.buffer_view,
            offset: sparse.indices.byte_offset.0,
            count,
            element_bytes: kind.size(),
        };
        let values =
            Range { view: sparse.values.buffer_view, offset: sparse.values.byte_offset.0, count, element_bytes };
        let indices = self.dense(&indices, &|bytes: &[u8]| integer(kind, bytes))?;
        for (index, value) in indices.into_iter().zip(self.dense(&values, decode)?) {
            let length = elements.len();
            *elements
                .get_mut(index as usize)
                .ok_or_else(|| format!("a sparse accessor of {length} elements replaces element {index}"))? = value;
        }
        Ok(())
    }

    fn dense<T>(&self, range: &Range, decode: &impl Fn(&[u8]) -> T) -> Result<Vec<T>, Problem> {
        let (view, stride) = self.view(range.view)?;
        let stride = stride.unwrap_or(range.element_bytes);
        if stride < range.element_bytes {
            return Err(format!("elements of {} bytes overlap at a stride of {stride}", range.element_bytes));
        }
        if range.count == 0 {
            return Ok(Vec::new());
        }
        let bytes = covered(range, stride).and_then(|(start, end)| view.get(start..end)).ok_or_else(|| {
            format!("an accessor of {} elements reaches beyond its buffer view of {} bytes", range.count, view.len())
        })?;
        // The last chunk may be shorter than the stride.
        Ok(bytes.chunks(stride).map(|chunk| decode(chunk.get(..range.element_bytes).unwrap_or(chunk))).collect())
    }

    pub(super) fn view(&self, index: Index<View>) -> Result<(&[u8], Option<usize>), Problem> {
        let index = index.value();
        let view = self
            .root
            .buffer_views
            .get(index)
            .ok_or_else(|| format!("it refers to buffer view {index}, which does not exist"))?;
        let buffer = self
            .buffers
            .get(view.buffer.value())
            .ok_or_else(|| format!("it refers to buffer {}, which does not exist", view.buffer.value()))?;
        let start = view.byte_offset.unwrap_or_default().0;
        let bytes = start
            .checked_add(view.byte_length.0)
            .and_then(|end| Some(usize::try_from(start).ok()?..usize::try_from(end).ok()?))
            .and_then(|range| buffer.get(range))
            .ok_or_else(|| format!("buffer view {index} reaches beyond its buffer of {} bytes", buffer.len()))?;
        Ok((bytes, view.byte_stride.as_ref().map(|stride| stride.0)))
    }
}

/// First byte of the first element and end of the last; the count is not zero.
fn covered(range: &Range, stride: usize) -> Option<(usize, usize)> {
    let start = usize::try_from(range.offset).ok()?;
    let steps = usize::try_from(range.count).ok()?.checked_sub(1)?.checked_mul(stride)?;
    Some((start, start.checked_add(steps)?.checked_add(range.element_bytes)?))
}

fn component_type(accessor: &Accessor) -> Result<ComponentType, Problem> {
    match accessor.component_type {
        Checked::Valid(accessor::GenericComponentType(kind)) => Ok(kind),
        Checked::Invalid => Err("an accessor has an unknown component type".to_owned()),
    }
}

fn check_type(accessor: &Accessor, expected: Type, name: &str) -> Result<(), Problem> {
    match accessor.type_ {
        Checked::Valid(kind) if kind == expected => Ok(()),
        _ => Err(format!("an accessor has another type than {name}")),
    }
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
