//! Cameras derived from another one or from a position: of a part of a picture, in a mirror, through a portal, and of a
//! cube map.

use std::f32::consts::FRAC_PI_2;

use glam::{DMat3, DQuat, DVec3, Mat3, Quat, Vec2, Vec3};

use super::camera::child_name;
use super::{Camera, ClipPlane, Projection, ViewKind};

impl Camera {
    /// The camera of one tile of this camera's picture, which is divided into `count` × `count` tiles. Tile `[0, 0]` is
    /// the upper left one. Each has this camera's `size`, so the tiles put together are a picture with `count` times as
    /// many pixels a row (M 10.1). The name is this camera's with the tile's column and row. All tiles have the same
    /// shadows, also those of different frames.
    ///
    /// ```
    /// use drawloom::glam::DVec3;
    /// use drawloom::scene::Camera;
    ///
    /// let camera = Camera::looking_at("main", DVec3::new(0.0, 1.0, 5.0), DVec3::ZERO);
    /// let cameras: Vec<_> = (0..4).map(|tile| camera.tile([tile % 2, tile / 2], 2)).collect();
    /// assert_eq!(cameras[1].name, "main, tile 1 0");
    /// ```
    ///
    /// # Panics
    /// If there is no such tile. If tiles are too many for the field of view of a camera, the frame has an error.
    pub fn tile(&self, [column, row]: [u32; 2], count: u32) -> Self {
        assert!(column < count && row < count, "tile {column} {row} is not one of {count} by {count}");
        // From the whole picture's centre to the tile's, in halves of the tile.
        let middle = |index: u32| 2.0 * index as f32 + 1.0;
        let offset = Vec2::new(middle(column) - count as f32, count as f32 - middle(row));
        let (name, whole) = (format!("{}, tile {column} {row}", self.name), Some(self.as_whole()));
        let mut camera = Self { name, whole, ..self.clone() };
        match &mut camera.projection {
            Projection::Perspective { field_of_view } => {
                let tangent = (f64::from(*field_of_view) * 0.5).tan() / f64::from(count);
                *field_of_view = (2.0 * tangent.atan()) as f32;
                camera.shift = self.shift * count as f32 + offset;
            }
            Projection::Orthographic { height } => {
                *height /= count as f32;
                let halves = offset * *height * 0.5;
                camera.move_aside(halves * Vec2::new(self.aspect(), 1.0));
            }
            Projection::Paraboloid => {}
        }
        camera
    }

    /// This camera, looking past its picture's centre by `offset` pixels to the right and up: the sub-pixel jitter of
    /// temporal antialiasing, and of antialiasing by the mean of several cameras (M 10.1). Neither changes a
    /// paraboloid.
    pub fn jittered(&self, offset: Vec2) -> Self {
        let halves = Vec2::new(self.size[0] as f32, self.size[1] as f32) * 0.5;
        let mut camera = Self { whole: Some(self.as_whole()), ..self.clone() };
        match self.projection {
            Projection::Perspective { .. } => camera.shift += offset / halves,
            Projection::Orthographic { height } => camera.move_aside(offset * (0.5 * height / halves.y)),
            Projection::Paraboloid => {}
        }
        camera
    }

    /// Moves the camera to the right and up, in metres.
    fn move_aside(&mut self, metres: Vec2) {
        self.position += self.orientation.as_dquat().normalize() * metres.as_dvec2().extend(0.0);
    }

    /// The camera whose picture a plane mirror shows this camera, for a view that the process of the mirror's surface
    /// samples as `mirror`: see [`Declare::samples_view`](crate::process::Declare::samples_view). The plane's normal is
    /// on the reflecting side.
    ///
    /// A camera cannot be mirrored, as front faces would become back faces. So this one sees left and right swapped:
    /// what this camera has at (x, y) is at (1 - x, y) in the mirror's picture, as shares of width and height. The
    /// mirror shows nothing if this camera is behind it, so leave the view out then. In perspective, what is behind the
    /// mirror is not drawn. The mirror's own surface lies in the plane: it must be single-sided, or in none of the
    /// camera's [layers](Camera::layers).
    ///
    /// ```
    /// use drawloom::glam::{DVec3, Vec3};
    /// use drawloom::scene::{Camera, ClipPlane};
    ///
    /// let camera = Camera::looking_at("main", DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO);
    /// let water = ClipPlane { point: DVec3::ZERO, normal: Vec3::Y };
    /// let mut cameras = vec![camera.clone()];
    /// if water.distance(camera.position) > 0.0 {
    ///     cameras.push(camera.reflected("water", water));
    /// }
    /// assert_eq!(cameras[1].name, "main/water");
    /// assert_eq!(cameras[1].position, DVec3::new(0.0, -1.5, 4.0));
    /// ```
    pub fn reflected(&self, mirror: &str, plane: ClipPlane) -> Self {
        let normal = plane.normal.as_dvec3().normalize();
        let reflect = |direction: DVec3| direction - normal * (2.0 * normal.dot(direction));
        let orientation = self.orientation.as_dquat().normalize();
        let [up, forward] = [DVec3::Y, DVec3::NEG_Z].map(|axis| reflect(orientation * axis));
        let axes = DMat3::from_cols(forward.cross(up), up, -forward);
        Self {
            name: self.child_name(mirror),
            position: self.position - normal * (2.0 * plane.distance(self.position)),
            orientation: DQuat::from_mat3(&axes).normalize().as_quat(),
            shift: self.shift * Vec2::new(-1.0, 1.0),
            whole: None,
            clip_plane: self.clips().then_some(plane),
            kind: ViewKind::Reflection,
            ..self.clone()
        }
    }

    /// The camera whose picture a portal shows this camera, for a view that the process of the portal's surface samples
    /// as `portal` at the same position of the picture. Who enters the portal at `entry` leaves it at `exit`: each is a
    /// point and an orientation whose +Z leads out of the portal.
    ///
    /// For a portal that is visible through itself, derive a camera from the result again, as often as the recursion is
    /// to be seen. A camera has one clip plane: the derived one replaces that of this camera. Leave the view out if
    /// this camera is behind the entry.
    pub fn through_portal(&self, portal: &str, entry: (DVec3, Quat), exit: (DVec3, Quat)) -> Self {
        let [entered, left] = [entry.1, exit.1].map(|orientation| orientation.as_dquat().normalize());
        // What goes into the entry comes out of the exit: half a turn between them.
        let turn = left * DQuat::from_rotation_y(std::f64::consts::PI) * entered.inverse();
        let clip_plane = ClipPlane { point: exit.0, normal: (left * DVec3::Z).as_vec3().normalize_or(Vec3::Z) };
        Self {
            name: self.child_name(portal),
            position: exit.0 + turn * (self.position - entry.0),
            orientation: (turn * self.orientation.as_dquat()).as_quat().normalize(),
            whole: None,
            clip_plane: self.clips().then_some(clip_plane),
            kind: ViewKind::Reflection,
            ..self.clone()
        }
    }

    /// The cameras of the six faces of a cube map around `position`, with the names `name/0` to `name/5`, for a process
    /// that [samples](crate::process::Declare::samples_view_cube) them as `name`. Each picture is `side` pixels wide
    /// and high and sees from `near` to infinity. What shows the cube map must be in none of the cameras'
    /// [layers](Camera::layers), or it hides everything else. They [sample no views](Camera::samples_views).
    pub fn cube_faces(name: &str, position: DVec3, side: u32, near: f32) -> [Self; 6] {
        // The order and the upper edges of WebGPU's faces, which are left-handed: the world's -Z is the cube's +Z.
        let faces = [
            (Vec3::X, Vec3::Y),
            (Vec3::NEG_X, Vec3::Y),
            (Vec3::Y, Vec3::Z),
            (Vec3::NEG_Y, Vec3::NEG_Z),
            (Vec3::NEG_Z, Vec3::Y),
            (Vec3::Z, Vec3::Y),
        ];
        let mut layers = 0..;
        faces.map(|(forward, up)| Self {
            name: child_name(name, &layers.next().unwrap_or_default().to_string()),
            position,
            orientation: Quat::from_mat3(&Mat3::from_cols(forward.cross(up), up, -forward)).normalize(),
            projection: Projection::Perspective { field_of_view: FRAC_PI_2 },
            near,
            size: [side; 2],
            samples_views: false,
            kind: ViewKind::Reflection,
            ..Self::looking_at("", position, position + forward.as_dvec3())
        })
    }

    /// Whether the camera can have a clip plane.
    fn clips(&self) -> bool {
        matches!(self.projection, Projection::Perspective { .. })
    }
}
