//! Which objects a process draws, and in which order.

use bytemuck::Pod;

use crate::scene::{Blend, LayerMask, MaterialLayout, MaterialType, ObjectColumn};

/// Which objects a process draws, and in which order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Selection {
    /// By blending.
    pub(crate) blending: Blending,
    /// By material.
    pub(crate) materials: MaterialShare,
    /// By the type of the material.
    pub(crate) material_types: MaterialTypes,
    /// By layer: objects that belong to one of these layers.
    pub(crate) layers: LayerMask,
    /// Objects that belong to one of these layers are left out.
    pub(crate) excluded_layers: LayerMask,
    /// By the layers that the view shows, which [`Camera::layers`](crate::scene::Camera::layers) sets: objects must
    /// belong to one of these as well.
    pub(crate) visible_layers: LayerMask,
    /// In which order they are drawn.
    pub(crate) order: DrawOrder,
}

impl Selection {
    /// Every opaque object.
    pub const OPAQUE: Self = Self::of(Blending::Opaque);
    /// Every blended object.
    pub const BLENDED: Self = Self::of(Blending::Blended);
    /// Every object: opaque ones first, then blended ones.
    pub const ALL: Self = Self::of(Blending::Both);

    const fn of(blending: Blending) -> Self {
        Self {
            blending,
            materials: MaterialShare::ALL,
            material_types: MaterialTypes::Any,
            layers: LayerMask::ALL,
            excluded_layers: LayerMask::NONE,
            visible_layers: LayerMask::ALL,
            order: DrawOrder::ByState,
        }
    }

    /// Objects that belong to one of these layers, instead of those of the layers before.
    pub const fn in_layers(self, layers: LayerMask) -> Self {
        Self { layers, ..self }
    }

    /// Those of these objects whose material has this [`MaterialType`].
    pub const fn of_material_type<T: Pod>(self, material_type: MaterialType<T>) -> Self {
        Self { material_types: MaterialTypes::Only(material_type.layout()), ..self }
    }

    /// Those of these objects whose material has no [`MaterialType`]: those that the shipped processes draw.
    pub const fn of_shipped_materials(self) -> Self {
        Self { material_types: MaterialTypes::Shipped, ..self }
    }

    /// Those of these objects whose material is in share `index` of `of` equal shares, counted from 0: several
    /// processes draw what one would (L 5). No shares count as one.
    pub const fn of_material_share(self, index: u32, of: u32) -> Self {
        Self { materials: MaterialShare { index, of }, ..self }
    }

    /// Those of these objects that belong to none of some layers.
    pub const fn not_in_layers(self, layers: LayerMask) -> Self {
        Self { excluded_layers: LayerMask(self.excluded_layers.0 | layers.0), ..self }
    }

    /// Those of these objects that a view of some layers shows.
    pub const fn visible_in(self, visible_layers: LayerMask) -> Self {
        Self { visible_layers, ..self }
    }

    /// The same objects in another order.
    pub const fn in_order(self, order: DrawOrder) -> Self {
        Self { order, ..self }
    }

    /// Whether it contains objects of any layer, and of any material type, that blend like this and have the material
    /// in this slot.
    pub fn contains(self, blend: Blend, material: u32) -> bool {
        let blends = match self.blending {
            Blending::Opaque => blend == Blend::None,
            Blending::Blended => blend != Blend::None,
            Blending::Both => true,
        };
        // The comparison comes first: the division costs as much as the rest of a command.
        blends && (self.materials == MaterialShare::ALL || material % self.materials.of.max(1) == self.materials.index)
    }
}

impl Default for Selection {
    fn default() -> Self {
        Self::OPAQUE
    }
}

/// The order in which a process draws objects (M 10.5, "multiple types of sorting"). Objects that it leaves open are
/// drawn by index.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum DrawOrder {
    /// Opaque objects by state and mesh, so that equal ones become one draw, and as
    /// [`Quality::opaque_order`](crate::quality::Quality::opaque_order) says; then blended ones, back to front.
    #[default]
    ByState,
    /// All by the distance of their centres along the view's axis, the nearest first: for expensive fragment shaders.
    /// As precise as [`Quality::blended_order`](crate::quality::Quality::blended_order).
    FrontToBack,
    /// The farthest first, with the same precision: where what is drawn depends on what is behind it.
    BackToFront,
    /// By a number that the engine has for each object, the smallest first: a column of the scene. The process need not
    /// declare that it reads it.
    ///
    /// ```
    /// use drawloom::command::{DrawOrder, Selection};
    /// use drawloom::scene::ObjectColumn;
    ///
    /// const DECAL_ORDER: ObjectColumn<u32> = ObjectColumn::new("decal order");
    ///
    /// let decals = Selection::BLENDED.in_order(DrawOrder::ByColumn(DECAL_ORDER));
    /// # assert_ne!(decals, Selection::BLENDED);
    /// ```
    ByColumn(ObjectColumn<u32>),
}

/// Objects by how they blend with the target's colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum Blending {
    /// Objects without blending.
    #[default]
    Opaque,
    /// Objects with any blending.
    Blended,
    /// Both.
    Both,
}

/// Objects by their material types.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) enum MaterialTypes {
    /// All.
    #[default]
    Any,
    /// Those without a [`MaterialType`].
    Shipped,
    /// Those of one type.
    Only(MaterialLayout),
}

impl MaterialTypes {
    /// Whether it contains materials of a type; `None` stands for those without one.
    #[inline]
    pub(crate) fn contains(self, material_type: Option<MaterialLayout>) -> bool {
        match self {
            Self::Any => true,
            Self::Shipped => material_type.is_none(),
            Self::Only(only) => material_type == Some(only),
        }
    }
}

/// A share of the materials: those whose slot modulo `of` is `index`. The shares 0 to `of` − 1 are disjoint and contain
/// every material, so a process that is added once per share splits its work by material (L 5).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct MaterialShare {
    /// Which share, counted from 0.
    pub(crate) index: u32,
    /// The number of shares; 0 counts as 1.
    pub(crate) of: u32,
}

impl MaterialShare {
    /// Every material.
    pub(crate) const ALL: Self = Self { index: 0, of: 1 };
}

impl Default for MaterialShare {
    fn default() -> Self {
        Self::ALL
    }
}
