//! The room of the bundled scene: a box around the observer, in metres, seen from its inside.

use super::sky::{smooth_step, sun_direction};
use lookalike::math::{
    Rgb, Vec3, cell,
    elementary::exp_bounded,
    sampling::{key, uniform},
};
use std::f64::consts::PI;

/// Y of the floor, relative to the observer's eye.
pub(super) const FLOOR: f64 = -1.2;

/// Radiance of the room from a unit direction; `None` if the direction passes through the opening.
pub(super) fn radiance(d: Vec3) -> Option<Rgb> {
    let far = |component: f64, low: f64, high: f64| if component > 0.0 { high / component } else { low / component };
    let to = Vec3::new(far(d.x, LOW.x, HIGH.x), far(d.y, LOW.y, HIGH.y), far(d.z, LOW.z, HIGH.z));
    let distance = to.min_element();
    let p = d * distance;
    if distance == to.y {
        return Some(if d.y < 0.0 { floor(p) } else { ceiling(p) });
    }
    if distance == to.x {
        return Some(if d.x < 0.0 { window_wall(p) } else { panel_wall(p) });
    }
    if d.z < 0.0 { Some(back_wall(p)) } else { front_wall(p) }
}

/// Light and dark stone tiles in a checkerboard, each of a slightly different tone.
fn floor(p: Vec3) -> Rgb {
    let (column, row) = ((p.x / TILE).floor(), (p.z / TILE).floor());
    let (x, z) = (p.x / TILE - column, p.z / TILE - row);
    let tile = key(&[cell(column + 64.0, 128) as u64, cell(row + 64.0, 128) as u64]);
    let base =
        if (column + row).rem_euclid(2.0) < 0.5 { Rgb::new(0.62, 0.54, 0.43) } else { Rgb::new(0.20, 0.15, 0.13) };
    let joint = x.min(z).min(1.0 - x).min(1.0 - z) < 0.02;
    let albedo = if joint { Rgb::splat(0.12) } else { base * (0.78 + 0.44 * uniform(tile)) };
    lit(p, Vec3::Y, albedo)
}

/// White boards and, across the room, dark beams.
fn ceiling(p: Vec3) -> Rgb {
    let along = p.z / 1.15 - (p.z / 1.15).floor();
    let albedo = if along < 0.24 { Rgb::new(0.17, 0.10, 0.06) } else { Rgb::new(0.80, 0.76, 0.70) };
    lit(p, Vec3::NEG_Y, albedo)
}

/// Four tall windows of frosted glass in plaster.
fn window_wall(p: Vec3) -> Rgb {
    let (y, inside) = (p.y - WINDOW_SILL, p.y > WINDOW_SILL && p.y < WINDOW_HEAD);
    let pane = WINDOWS.iter().map(|center| p.z - center).find(|z| z.abs() < WINDOW_HALF_WIDTH);
    match pane {
        Some(z) if inside => {
            let height = WINDOW_HEAD - WINDOW_SILL;
            let edge = (WINDOW_HALF_WIDTH - z.abs()).min(y).min(height - y);
            let bar = z.abs() < 0.03 || (y - 0.62 * height).abs() < 0.03 || edge < 0.05;
            if bar { lit(p, Vec3::X, Rgb::splat(0.10)) } else { WINDOW_GLOW * (0.55 + 0.45 * y / height) }
        }
        _ => lit(p, Vec3::X, PLASTER),
    }
}

/// A red panel and a dark doorway in plaster.
fn panel_wall(p: Vec3) -> Rgb {
    let frame =
        |z: f64, half_width: f64, low: f64, high: f64| (half_width - (p.z - z).abs()).min(p.y - low).min(high - p.y);
    let door = (0.62 - (p.z + 1.1).abs()).min(1.15 - p.y);
    if door > 0.0 {
        let depth = smooth_step(0.0, 0.5, door);
        return Rgb::new(0.05, 0.035, 0.025) * (1.0 - 0.85 * depth);
    }
    if door > -0.09 {
        return lit(p, Vec3::NEG_X, Rgb::new(0.22, 0.13, 0.07));
    }
    let panel = frame(1.55, 1.05, -0.35, 1.55);
    if panel > 0.07 {
        return lit(p, Vec3::NEG_X, Rgb::new(0.82, 0.09, 0.035)) * 1.25;
    }
    lit(p, Vec3::NEG_X, if panel > 0.0 { Rgb::splat(0.06) } else { PLASTER })
}

/// A teal niche with a shelf in plaster.
fn back_wall(p: Vec3) -> Rgb {
    let niche = (1.9 - p.x.abs()).min(p.y + 0.5).min(1.5 - p.y);
    let shelf = (p.y - 0.5).abs() < 0.04;
    let albedo = match niche {
        depth if depth > 0.0 && shelf => Rgb::new(0.45, 0.28, 0.14),
        depth if depth > 0.0 => Rgb::new(0.05, 0.34, 0.36) * smooth_step(-0.15, 0.35, depth),
        _ => PLASTER,
    };
    lit(p, Vec3::Z, albedo)
}

/// The opening to the terrace between two columns, under a lintel.
fn front_wall(p: Vec3) -> Option<Rgb> {
    if in_opening(p.x, p.y) {
        return None;
    }
    let across = COLUMNS.iter().map(|x| (p.x - x) / COLUMN_RADIUS).find(|x| x.abs() < 1.0);
    match across {
        // Backlit round columns: bright towards the windows, dark in the middle.
        Some(x) if p.y < OPENING_TOP => Some(Rgb::new(0.75, 0.70, 0.62) * (0.16 + 0.5 * smooth_step(0.1, -1.0, x))),
        _ => Some(lit(p, Vec3::NEG_Z, PLASTER)),
    }
}

fn in_opening(x: f64, y: f64) -> bool {
    x.abs() < OPENING_HALF_WIDTH && y < OPENING_TOP && COLUMNS.iter().all(|c| (x - c).abs() >= COLUMN_RADIUS)
}

/// Radiance of a diffuse surface at `p`, lit by the opening, the windows and the sun; `normal` points into the room.
fn lit(p: Vec3, normal: Vec3, albedo: Rgb) -> Rgb {
    let opening = Vec3::new(0.0, 0.5 * (FLOOR + OPENING_TOP), HIGH.z);
    let mut light = AMBIENT + OPENING_LIGHT * disc_factor(p, normal, opening, Vec3::NEG_Z, 14.0);
    for center in WINDOWS {
        let window = Vec3::new(LOW.x, 0.5 * (WINDOW_SILL + WINDOW_HEAD), center);
        light += WINDOW_GLOW * 0.8 * disc_factor(p, normal, window, Vec3::X, 2.4);
    }
    let sun = sun_direction();
    let to_front = (HIGH.z - p.z) / sun.z;
    let crossing = p + sun * to_front;
    if normal.dot(sun) > 0.0 && in_opening(crossing.x, crossing.y) {
        light += SUNLIGHT * normal.dot(sun);
    }
    albedo * light * corner_shade(p)
}

/// The approximate form factor at `p` of a disc of this area (cosine-weighted).
fn disc_factor(p: Vec3, normal: Vec3, center: Vec3, facing: Vec3, area: f64) -> f64 {
    let to = center - p;
    let squared = to.length_squared();
    let (here, there) = (normal.dot(to).max(0.0), -facing.dot(to).min(0.0));
    area * here * there / (squared * (PI * squared + area))
}

/// Darkening where two walls meet.
fn corner_shade(p: Vec3) -> f64 {
    let near = |x: f64, low: f64, high: f64| {
        let distance = (x - low).min(high - x).max(0.0);
        // The wall on which the point lies does not count.
        if distance < 1e-9 { 1.0 } else { 1.0 - 0.45 * exp_bounded(-distance / 0.3) }
    };
    near(p.x, LOW.x, HIGH.x) * near(p.y, LOW.y, HIGH.y) * near(p.z, LOW.z, HIGH.z)
}

/// Corners of the room relative to the eye.
const LOW: Vec3 = Vec3::new(-3.4, FLOOR, -4.2);
const HIGH: Vec3 = Vec3::new(3.4, 2.5, 4.0);
const TILE: f64 = 0.75;
const PLASTER: Rgb = Rgb::new(0.70, 0.63, 0.54);
const WINDOWS: [f64; 4] = [-2.9, -1.1, 0.7, 2.5];
const WINDOW_HALF_WIDTH: f64 = 0.52;
const WINDOW_SILL: f64 = -0.45;
const WINDOW_HEAD: f64 = 2.0;
const WINDOW_GLOW: Rgb = Rgb::new(4.6, 5.0, 5.6);
const OPENING_HALF_WIDTH: f64 = 2.7;
const OPENING_TOP: f64 = 2.05;
const COLUMNS: [f64; 2] = [-1.15, 1.15];
const COLUMN_RADIUS: f64 = 0.13;
const AMBIENT: Rgb = Rgb::new(0.20, 0.19, 0.18);
const OPENING_LIGHT: Rgb = Rgb::new(1.5, 1.5, 1.5);
/// Radiance that the sun adds to a white surface facing it: more than its radiance in the map gives, because that looks better.
const SUNLIGHT: Rgb = Rgb::new(3.4, 2.8, 1.9);
