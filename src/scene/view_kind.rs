//! The kinds of views, and the table of what each kind is.

/// The purpose of a view (M listing 10.4). If two views do not depend on each other, the earlier kind comes first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ViewKind {
    /// The shadow map of a light.
    Shadow,
    /// The picture of a mirror, a portal or a screen in the scene. The [deferred pipeline](crate::process::Deferred)
    /// draws in it what it draws in a main view, as far as others [sample](crate::process::Declare::samples_view) it.
    /// Shadow maps of directional lights cover what a main view sees, so elsewhere nothing is in their shadow: the main
    /// view that it is [named](super::Camera::child_name) after, as `main/mirror` is after `main`, or else the scene's
    /// first one.
    Reflection,
    /// A kind of an engine's own, as are the three after it: a map seen from above, a probe, a screen. Only processes that
    /// [declare](crate::process::Declare::views) it draw in its views. Views of other kinds
    /// [sample](crate::process::Declare::samples_view) them. Lights reach it, without shadow maps of directional lights
    /// of its own.
    ///
    /// ```
    /// use drawloom::scene::ViewKind;
    ///
    /// /// What the engine calls it.
    /// const MAP: ViewKind = ViewKind::Own1;
    /// ```
    Own1,
    /// As [`ViewKind::Own1`].
    Own2,
    /// As [`ViewKind::Own1`].
    Own3,
    /// As [`ViewKind::Own1`].
    Own4,
    /// The picture on the screen.
    #[default]
    Main,
    /// A picture composed of other pictures.
    Post,
}

/// The properties of a kind of view. All code that treats kinds differently reads them, so a kind that is new needs
/// nothing but a row in [`ViewKind::rules`].
#[derive(Debug)]
pub(crate) struct ViewRules {
    /// The lower-case name in reports.
    pub(crate) name: &'static str,
    /// Whether its views are the layers of the lights' shadow maps.
    pub(crate) is_shadow_map: bool,
    /// Whether lights, and their shadow maps, are gathered for what it shows.
    pub(crate) is_lit: bool,
    /// Whether shadow maps of directional lights are drawn for what its cameras see.
    pub(crate) owns_shadow_maps: bool,
    /// Whether an orthographic projection clamps depth to the near plane (pancaking): what is in front of it casts
    /// shadows.
    pub(crate) clamps_depth: bool,
    /// Whether its cameras may have a paraboloid projection.
    pub(crate) allows_paraboloid: bool,
    /// Whether objects that others hide may be removed.
    #[cfg_attr(not(feature = "occlusion"), expect(dead_code))]
    pub(crate) culls_hidden: bool,
    /// How many times as large the error of a level of detail may be as in a main view.
    pub(crate) level_error_scale: f64,
    /// The kind whose processes in a pipeline's chain draw in this one too.
    pub(crate) shares_chain_of: Option<ViewKind>,
    /// Whether a pipeline's frames have processes for it only if the scene has a camera of it.
    pub(crate) is_optional: bool,
    /// Whether a plan names its processes and targets as they are declared, without the name of the kind.
    pub(crate) has_plain_names: bool,
}

impl ViewRules {
    /// Those of a kind of an engine's own.
    const fn of_engine(name: &'static str) -> Self {
        Self {
            name,
            is_shadow_map: false,
            is_lit: true,
            owns_shadow_maps: false,
            clamps_depth: false,
            allows_paraboloid: false,
            culls_hidden: true,
            level_error_scale: 1.0,
            shares_chain_of: None,
            is_optional: true,
            has_plain_names: false,
        }
    }
}

impl ViewKind {
    /// How many kinds there are.
    pub const COUNT: usize = Self::ALL.len();

    /// All kinds, in order.
    pub(crate) const ALL: [Self; 8] =
        [Self::Shadow, Self::Reflection, Self::Own1, Self::Own2, Self::Own3, Self::Own4, Self::Main, Self::Post];

    /// The properties of the kind.
    pub(crate) const fn rules(self) -> &'static ViewRules {
        match self {
            Self::Shadow => &ViewRules {
                name: "shadow",
                is_shadow_map: true,
                is_lit: false,
                owns_shadow_maps: false,
                clamps_depth: true,
                allows_paraboloid: true,
                culls_hidden: false,
                level_error_scale: 2.0,
                shares_chain_of: None,
                is_optional: false,
                has_plain_names: false,
            },
            Self::Reflection => &ViewRules {
                name: "reflection",
                is_shadow_map: false,
                is_lit: true,
                owns_shadow_maps: false,
                clamps_depth: false,
                allows_paraboloid: false,
                culls_hidden: true,
                level_error_scale: 1.0,
                shares_chain_of: Some(Self::Main),
                is_optional: true,
                has_plain_names: false,
            },
            Self::Own1 => const { &ViewRules::of_engine("own 1") },
            Self::Own2 => const { &ViewRules::of_engine("own 2") },
            Self::Own3 => const { &ViewRules::of_engine("own 3") },
            Self::Own4 => const { &ViewRules::of_engine("own 4") },
            Self::Main => &ViewRules {
                name: "main",
                is_shadow_map: false,
                is_lit: true,
                owns_shadow_maps: true,
                clamps_depth: false,
                allows_paraboloid: false,
                culls_hidden: true,
                level_error_scale: 1.0,
                shares_chain_of: None,
                is_optional: false,
                has_plain_names: true,
            },
            Self::Post => &ViewRules {
                name: "post",
                is_shadow_map: false,
                is_lit: true,
                owns_shadow_maps: false,
                clamps_depth: false,
                allows_paraboloid: false,
                culls_hidden: true,
                level_error_scale: 1.0,
                shares_chain_of: None,
                is_optional: false,
                has_plain_names: false,
            },
        }
    }

    /// The lower-case name in reports.
    pub fn name(self) -> &'static str {
        self.rules().name
    }
}

// Arrays with an entry for each kind are indexed by `kind as usize`.
const _: () = {
    let mut index = 0;
    while index < ViewKind::COUNT {
        assert!(ViewKind::ALL[index] as usize == index, "ViewKind::ALL has a kind too few, or another order");
        index += 1;
    }
};

#[cfg(test)]
mod tests {
    use super::ViewKind::{self, Main, Own1, Own2, Own3, Own4, Post, Reflection, Shadow};

    /// Does not compile without an arm for each kind.
    fn next(kind: ViewKind) -> Option<ViewKind> {
        match kind {
            Shadow => Some(Reflection),
            Reflection => Some(Own1),
            Own1 => Some(Own2),
            Own2 => Some(Own3),
            Own3 => Some(Own4),
            Own4 => Some(Main),
            Main => Some(Post),
            Post => None,
        }
    }

    #[test]
    fn all_kinds_are_listed() {
        assert!(std::iter::successors(Some(Shadow), |kind| next(*kind)).eq(ViewKind::ALL));
    }
}
