//! Errors of raw passes that ask for what they may not use.

use crate::scene::ViewKind;

/// Why a raw pass does not get a resource that it asks for. The plan orders processes by what they declare, so another
/// target may not be written yet, or not exist.
///
/// The frame fails with the first such error, as [`BackendError::Access`](crate::backend::BackendError::Access), even
/// if the raw pass goes on without the resource.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum AccessError {
    /// A target of the view.
    #[error("process {process:?} asks for target {target:?} in its raw pass, but declares only: {declared}")]
    UndeclaredTarget {
        /// The process.
        process: String,
        /// The target.
        target: String,
        /// The targets of the view that it declares.
        declared: String,
    },
    /// A texture array that all views of a kind share.
    #[error(
        "process {process:?} asks for target {target:?} of all {} views in its raw pass, but declares only: {declared}",
        views.name()
    )]
    UndeclaredLayeredTarget {
        /// The process.
        process: String,
        /// The kind of the views.
        views: ViewKind,
        /// The target.
        target: String,
        /// The targets of such views that it declares.
        declared: String,
    },
    /// A target that the process declares, but that is no texture array: each view has its own.
    #[error("process {process:?} asks for target {target:?} of all {} views, but each of them has its own", views.name())]
    NotLayered {
        /// The process.
        process: String,
        /// The kind of the views.
        views: ViewKind,
        /// The target.
        target: String,
    },
    /// A column of objects, or one that the process declares with elements of another size.
    #[error(
        "process {process:?} asks for the column {column:?} with {stride} bytes for each object in its raw pass, but does not declare it"
    )]
    UndeclaredColumn {
        /// The process.
        process: String,
        /// The column.
        column: &'static str,
        /// The size of an element in bytes.
        stride: usize,
    },
    /// The values of a material type, or of one that the process declares with values of another size.
    #[error(
        "process {process:?} asks for the material type {material_type:?} with {stride} bytes for each material in its raw pass, but does not declare it"
    )]
    UndeclaredMaterialType {
        /// The process.
        process: String,
        /// The material type.
        material_type: &'static str,
        /// The size of the values of a material in bytes.
        stride: usize,
    },
    /// A buffer, or one that the process declares with another size.
    #[error(
        "process {process:?} asks for the buffer {buffer:?} of {bytes} bytes in its raw pass, but does not declare it"
    )]
    UndeclaredBuffer {
        /// The process.
        process: String,
        /// The buffer.
        buffer: &'static str,
        /// Its size in bytes.
        bytes: u64,
    },
    /// The frame lacks a resource that the process declares. This is a bug in Drawloom.
    #[error("process {process:?} declares {resource}, which the frame lacks: a bug in Drawloom")]
    Missing {
        /// The process.
        process: String,
        /// The kind and the name of the resource.
        resource: String,
    },
}
