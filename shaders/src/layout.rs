//! Holds a `repr(C)` struct equal to its WGSL twin: names, offsets and sizes, as naga lays them out.

use naga::TypeInner;

/// Panics, naming the difference, unless the WGSL struct `name` of the module `path` has the size `size` and exactly these
/// fields: name, offset and size in bytes. Fields whose names start with `padding` are left out on both sides.
///
/// # Panics
/// When the layouts differ, or the module or the struct is missing: this is a test's assertion.
pub fn assert_struct(path: &str, name: &str, size: usize, fields: &[(&str, usize, usize)]) {
    let text = crate::source(path).unwrap_or_else(|error| panic!("{error}"));
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|error| panic!("{}", error.emit_to_string(&text)));
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap_or_else(|error| panic!("{path}: {error}"));
    let found = module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name));
    let Some((_, naga::Type { inner: TypeInner::Struct { members, span }, .. })) = found else {
        panic!("{path} has no struct {name}");
    };
    let theirs: Vec<(String, usize, usize)> = members
        .iter()
        .map(|member| {
            let bytes = module.types[member.ty].inner.size(module.to_ctx()) as usize;
            (member.name.clone().unwrap_or_default(), member.offset as usize, bytes)
        })
        .filter(|(name, _, _)| !name.starts_with("padding"))
        .collect();
    let ours: Vec<(String, usize, usize)> = fields
        .iter()
        .filter(|(name, _, _)| !name.starts_with("padding"))
        .map(|&(name, offset, bytes)| (name.to_owned(), offset, bytes))
        .collect();
    assert_eq!(ours, theirs, "struct {name} of {path}: (name, offset, size), Rust left, WGSL right");
    assert_eq!(size, *span as usize, "size of struct {name} of {path}");
}

/// [`assert_struct`] of a Rust struct, with the fields to compare.
///
/// ```ignore
/// assert_layout!(PinholeUniform, "camera/pinhole.wgsl", "Pinhole", eye_from_world, eye_anchor);
/// ```
#[macro_export]
macro_rules! assert_layout {
    ($ty:ty, $path:expr, $name:expr, $($field:ident),+ $(,)?) => {{
        fn size_of_field<T, F>(_: fn(&T) -> &F) -> usize {
            std::mem::size_of::<F>()
        }
        $crate::layout::assert_struct($path, $name, std::mem::size_of::<$ty>(), &[
            $((stringify!($field), std::mem::offset_of!($ty, $field), size_of_field(|s: &$ty| &s.$field))),+
        ]);
    }};
}
