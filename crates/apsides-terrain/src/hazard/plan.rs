//! From heights to layers and verdicts, tile by tile.

use rayon::prelude::*;

use super::angle::angle;
use super::extremes::{larger, largest_within};
use super::farthest::{Extremes, LEAST_REACH};
use super::footprint::Footpads;
use super::normals::NormalPairs;
use super::plane::Planes;
use super::residual::{residuals, roughness_at};
use super::stance::{Stance, contact_slope_at};
use super::tile::{Rows, TILE_COLS, TILE_ROWS, Tile};
use super::{HazardOptions, Layer, LayerChoice, Plane, SiteCriteria, Verdict, Watch};
use crate::disk::Disk;
use crate::error::short;
use crate::{Geometry, TerrainError};

/// Number of layers.
pub(super) const LAYERS: usize = Layer::ALL.len();

/// Most pixels from the centre of a footprint to its edge.
const LARGEST_REACH: f64 = 1000.0;

/// Most pixels from a centre to those whose normals are taken: the pairs grow with the fourth power.
const LARGEST_PAIRS: f64 = 10.0;

/// Roundings of `f32` that a layer may be off by, in units of the largest height: closer to a threshold, `f64` decides.
const ROUNDINGS: f64 = 16.0;

/// The layers that are made of each tile.
#[derive(Debug)]
pub(super) struct Plan {
    criteria: SiteCriteria,
    geometry: Geometry,
    datum: f64,
    pixel_m: f64,
    disk: Disk,
    pads: Footpads,
    belly: Option<Disk>,
    normals: Option<NormalPairs>,
    plane: Option<Plane>,
    /// Layers that are made, kept, and tested against a limit, by their place in [`Layer::ALL`].
    made: [bool; LAYERS],
    pub(super) kept: [bool; LAYERS],
    limits: [Option<f64>; LAYERS],
    /// Pixels whose verdict is known need no further layers.
    short_cuts: bool,
    /// Margin that a tile needs.
    pub(super) halo: usize,
}

/// Place in [`Layer::ALL`].
pub(super) fn slot(layer: Layer) -> usize {
    match layer {
        Layer::Slope => 0,
        Layer::FootpadSlope => 1,
        Layer::Roughness => 2,
        Layer::RoughnessRms => 3,
        Layer::Step => 4,
        Layer::BellyClearance => 5,
        Layer::RelativeElevation => 6,
        Layer::FootpadSlopeLeast => 7,
        Layer::NormalSlope => 8,
        Layer::Edges => 9,
    }
}

impl Plan {
    pub(super) fn new(
        geometry: &Geometry,
        datum: f64,
        criteria: &SiteCriteria,
        options: &HazardOptions,
    ) -> Result<Plan, TerrainError> {
        criteria.check()?;
        let pixel_m = geometry.square_pixel()?;
        let within = |name, radius: f64, [least, most]: [f64; 2]| {
            let value = radius / pixel_m;
            let allowed = if value < least {
                format!(
                    "pixels of {} m are too coarse for it; take a map with pixels of at most {} m, or criteria with at least {} m",
                    short(pixel_m),
                    short(radius / least),
                    short(least * pixel_m)
                )
            } else {
                format!(
                    "on pixels of {} m it may be {} m at most, {most} pixels; take criteria with less, or a coarser map",
                    short(pixel_m),
                    short(most * pixel_m)
                )
            };
            let fits = value >= least && value <= most;
            if fits {
                Ok(())
            } else {
                Err(TerrainError::Number { name, value: radius, allowed: allowed.into() })
            }
        };
        let reach = |name, radius, least| within(name, radius, [least, LARGEST_REACH]);
        reach("footprint_radius_m", criteria.footprint_radius_m, 1.0)?;
        reach("footpad_circle_radius_m", criteria.footpad_circle_radius_m, 0.0)?;
        reach("footpad_radius_m", criteria.footpad_radius_m, 0.0)?;
        criteria.belly.map_or(Ok(()), |belly| reach("belly.radius_m", belly.radius_m, 0.0))?;
        let pairs = |radius| within("normals.radius_m", radius, [2.0, LARGEST_PAIRS]);
        criteria.normals.map_or(Ok(()), |normals| pairs(normals.radius_m))?;

        // Edges are not of tiles but of the whole map.
        let limits = Layer::ALL.map(|layer| criteria.limit(layer).filter(|_| layer != Layer::Edges));
        let possible = |layer| match layer {
            Layer::BellyClearance => criteria.belly.is_some(),
            Layer::RelativeElevation => options.plane.is_some(),
            Layer::NormalSlope => criteria.normals.is_some() && options.plane.is_some(),
            Layer::Edges => false,
            _ => true,
        };
        let kept = Layer::ALL
            .map(|layer| options.layers.keeps(layer, limits[slot(layer)].is_some()) && possible(layer));
        let made = std::array::from_fn(|k| kept[k] || limits[k].is_some());
        let disk = Disk::new(criteria.footprint_radius_m, pixel_m);
        let pads = Footpads::new(criteria, pixel_m);
        let belly = criteria.belly.map(|belly| Disk::new(belly.radius_m, pixel_m));
        let normals = criteria.normals.map(|normals| NormalPairs::new(normals.radius_m, pixel_m));
        let below = belly.as_ref().map_or(0, |b| b.reach).max(normals.as_ref().map_or(0, |n| n.reach));
        let halo = disk.reach.max(pads.reach + pads.pad.reach).max(below);
        Ok(Plan {
            criteria: *criteria,
            geometry: *geometry,
            datum,
            pixel_m,
            disk,
            pads,
            belly,
            normals,
            plane: options.plane,
            made,
            kept,
            limits,
            short_cuts: options.layers == LayerChoice::None,
            halo,
        })
    }

    fn makes(&self, layer: Layer) -> bool {
        self.made[slot(layer)]
    }

    /// Rows `first..end` of the map, `first` on the grid of tiles: layers that are kept and verdicts, full rows. Tiles that the watch does not let
    /// pass are unknown ground.
    pub(super) fn rows(
        &self,
        source: &Rows,
        first: usize,
        end: usize,
        layers: &mut [Vec<f32>; LAYERS],
        verdict: &mut [Verdict],
        watch: Watch<'_>,
    ) {
        debug_assert!(first.is_multiple_of(TILE_ROWS));
        let cols = source.map[1];
        let mut parts: Vec<_> = layers.iter_mut().map(|layer| layer.chunks_mut(TILE_ROWS * cols)).collect();
        let bands: Vec<Band> = verdict
            .chunks_mut(TILE_ROWS * cols)
            .map(|verdict| Band { layers: std::array::from_fn(|k| parts[k].next()), verdict })
            .collect();
        bands.into_par_iter().enumerate().for_each_init(Work::default, |work, (k, mut band)| {
            for col in (0..cols).step_by(TILE_COLS) {
                let at = [first + k * TILE_ROWS, col];
                let size = [TILE_ROWS.min(end - at[0]), TILE_COLS.min(cols - col)];
                if watch(size[0] * size[1]) {
                    work.tile.load(source, at, end, self.halo);
                    self.tile(work);
                    work.hand_over(&mut band, cols);
                } else {
                    band.leave(col, size, cols);
                }
            }
        });
    }

    /// Layers and verdicts of the tile that is loaded.
    fn tile(&self, work: &mut Work) {
        let size = work.tile.size();
        for (k, layer) in work.layers.iter_mut().enumerate() {
            if self.made[k] {
                layer.resize(size, 0.0);
            }
        }
        self.known(work);
        work.active.clone_from(&work.known);
        self.planes(work);
        self.footpads(work);
        self.roughness(work);
        self.step(work);
        self.belly(work);
        self.relative_elevation(work);
        self.normal_slope(work);
        work.verdict.clear();
        work.verdict.extend(work.known.iter().map(|&known| match known {
            0 => Verdict::Unknown,
            _ => Verdict::Safe,
        }));
        for (k, limit) in self.limits.iter().enumerate().rev() {
            let Some(limit) = *limit else { continue };
            for (verdict, &value) in work.verdict.iter_mut().zip(&work.layers[k]) {
                if Layer::ALL[k].breaks(value, limit) && *verdict != Verdict::Unknown {
                    *verdict = Verdict::Unsafe(Layer::ALL[k]);
                }
            }
        }
        for k in (0..LAYERS).filter(|&k| self.kept[k]) {
            let known = match Layer::ALL[k] {
                Layer::Slope | Layer::Roughness | Layer::RoughnessRms | Layer::Step => &work.known_disk,
                Layer::FootpadSlope | Layer::FootpadSlopeLeast => &work.known_pads,
                Layer::BellyClearance => &work.known_belly,
                Layer::RelativeElevation | Layer::Edges => &work.known_centre,
                Layer::NormalSlope => &work.known_normals,
            };
            for (value, _) in work.layers[k].iter_mut().zip(known).filter(|(_, known)| **known == 0) {
                *value = f32::NAN;
            }
        }
    }

    /// The pixels that have their whole footprint on known ground.
    fn known(&self, work: &mut Work) {
        let Work { tile, .. } = work;
        tile.inside(self.disk.reach, &mut work.known_disk);
        tile.inside(self.pads.reach, &mut work.known_pads);
        tile.inside(self.belly.as_ref().map_or(0, |belly| belly.reach), &mut work.known_belly);
        tile.inside(0, &mut work.known_centre);
        tile.inside(self.normals.as_ref().map_or(0, |normals| normals.reach), &mut work.known_normals);
        if !tile.gap.is_empty() {
            let (space, near) = (&mut work.space, &mut work.near);
            largest_within(&tile.gap, tile.stride, &self.disk, space, near);
            exclude(tile, near, &[(0, 0)], &mut work.known_disk);
            exclude(tile, &tile.gap, &[(0, 0)], &mut work.known_centre);
            if let Some(belly) = &self.belly {
                largest_within(&tile.gap, tile.stride, belly, space, near);
                exclude(tile, near, &[(0, 0)], &mut work.known_belly);
            }
            largest_within(&tile.gap, tile.stride, &self.pads.pad, space, near);
            exclude(tile, near, &self.pads.pixels(), &mut work.known_pads);
            if let Some(normals) = &self.normals {
                exclude(tile, &tile.gap, &normals.offsets, &mut work.known_normals);
                exclude(tile, &tile.gap, &[(0, 0)], &mut work.known_normals);
            }
        }
        for k in 0..work.known_belly.len() {
            work.known_belly[k] &= work.known_disk[k] & work.known_pads[k];
        }
        let tested = |layers: &[Layer]| layers.iter().any(|&layer| self.limits[slot(layer)].is_some());
        let normals = tested(&[Layer::NormalSlope]);
        let (disk, pads, belly) = (
            tested(&[Layer::Slope, Layer::Roughness, Layer::RoughnessRms, Layer::Step]),
            tested(&[Layer::FootpadSlope]),
            tested(&[Layer::BellyClearance]),
        );
        work.known.clone_from(&work.known_centre);
        let used = [
            (disk, &work.known_disk),
            (pads, &work.known_pads),
            (belly, &work.known_belly),
            (normals, &work.known_normals),
        ];
        for (_, part) in used.into_iter().filter(|(used, _)| *used) {
            work.known.iter_mut().zip(part).for_each(|(known, part)| *known &= part);
        }
    }

    /// The pixels at which a layer has to be made.
    fn active<'a>(&self, work_active: &'a [u8], known: &'a [u8]) -> &'a [u8] {
        if self.short_cuts { work_active } else { known }
    }

    /// With short cuts, what breaks the threshold of a layer needs no further one.
    fn settle(&self, work: &mut Work, layer: Layer) {
        let (true, Some(limit)) = (self.short_cuts, self.limits[slot(layer)]) else { return };
        for (active, &value) in work.active.iter_mut().zip(&work.layers[slot(layer)]) {
            *active &= u8::from(!layer.breaks(value, limit));
        }
    }

    fn planes(&self, work: &mut Work) {
        let used = [Layer::Slope, Layer::Roughness, Layer::RoughnessRms, Layer::BellyClearance];
        if !used.iter().any(|&layer| self.makes(layer)) {
            return;
        }
        let rms = self.makes(Layer::RoughnessRms);
        work.planes.fit(&work.tile, &self.disk, self.pixel_m, rms);
        if self.makes(Layer::Slope) {
            let slope = &mut work.layers[slot(Layer::Slope)];
            slope.iter_mut().zip(&work.planes.tangent).for_each(|(slope, t)| *slope = angle(*t));
            self.settle(work, Layer::Slope);
        }
        if rms {
            work.layers[slot(Layer::RoughnessRms)].copy_from_slice(&work.planes.rms);
        }
    }

    fn footpads(&self, work: &mut Work) {
        let all = self.makes(Layer::FootpadSlopeLeast) || self.makes(Layer::BellyClearance);
        if !all && !self.makes(Layer::FootpadSlope) {
            return;
        }
        let Work { tile, top, space, stance, layers, .. } = work;
        let top: &[f32] = if self.pads.pad.count > 1 {
            work.near.clone_from(&tile.z);
            tile.set_outside(&mut work.near, f32::NEG_INFINITY);
            largest_within(&work.near, tile.stride, &self.pads.pad, space, top);
            top
        } else {
            &tile.z
        };
        let active = self.active(&work.active, &work.known_pads);
        stance.stand(tile, top, &self.pads, active, all);
        if self.makes(Layer::FootpadSlopeLeast) {
            let layer = &mut layers[slot(Layer::FootpadSlopeLeast)];
            layer.iter_mut().zip(&stance.least).for_each(|(slope, s)| *slope = angle(s.sqrt()));
        }
        if self.makes(Layer::FootpadSlope) {
            let layer = &mut layers[slot(Layer::FootpadSlope)];
            layer.iter_mut().zip(&stance.most).for_each(|(slope, s)| *slope = angle(s.sqrt()));
            if let Some(limit) = self.limits[slot(Layer::FootpadSlope)] {
                let open = open_within(tile.largest, self.pads.circle_m)
                    + ROUNDINGS * f64::from(f32::EPSILON) * limit;
                decide(tile, layer, active, limit, open, |y, x| {
                    contact_slope_at(tile, top, &self.pads, y, x)
                });
            }
            self.settle(work, Layer::FootpadSlope);
        }
    }

    fn roughness(&self, work: &mut Work) {
        if !self.makes(Layer::Roughness) {
            return;
        }
        let Work { tile, planes, high, low, layers, extremes, .. } = work;
        let active = self.active(&work.active, &work.known_disk);
        if self.disk.reach < LEAST_REACH {
            residuals(tile, &self.disk, planes, active, high, low);
            high.iter_mut().zip(low).for_each(|(high, low)| *high = larger(*high, -*low));
        } else {
            extremes.farthest(tile, &self.disk, planes, active, high);
        }
        let layer = &mut layers[slot(Layer::Roughness)];
        for ((roughness, far), t) in layer.iter_mut().zip(high).zip(&planes.tangent) {
            *roughness = *far / (1.0 + t * t).sqrt();
        }
        if let Some(limit) = self.limits[slot(Layer::Roughness)] {
            let at = |y, x| roughness_at(tile, &self.disk, self.pixel_m, y, x);
            decide(tile, layer, active, limit, open_within(tile.largest, 1.0), at);
        }
        self.settle(work, Layer::Roughness);
        // Made together with the plane, tested in its turn.
        if self.makes(Layer::RoughnessRms) {
            self.settle(work, Layer::RoughnessRms);
        }
    }

    fn step(&self, work: &mut Work) {
        if !self.makes(Layer::Step) {
            return;
        }
        let Work { tile, top, near, space, layers, .. } = work;
        largest_within(&tile.z, tile.stride, &self.disk, space, near);
        let negative: Vec<f32> = tile.z.iter().map(|z| -z).collect();
        largest_within(&negative, tile.stride, &self.disk, space, top);
        let layer = &mut layers[slot(Layer::Step)];
        for y in 0..tile.rows {
            for x in 0..tile.width {
                let at = tile.index(y, x);
                layer[y * tile.width + x] = near[at] + top[at];
            }
        }
        self.settle(work, Layer::Step);
    }

    fn belly(&self, work: &mut Work) {
        let (true, Some(disk), Some(belly)) =
            (self.makes(Layer::BellyClearance), &self.belly, self.criteria.belly)
        else {
            return;
        };
        let Work { tile, planes, high, low, layers, stance, .. } = work;
        let active = self.active(&work.active, &work.known_belly);
        residuals(tile, disk, planes, active, high, low);
        for (k, clearance) in layers[slot(Layer::BellyClearance)].iter_mut().enumerate() {
            let t = planes.tangent[k];
            let lift = (stance.seat[k] - planes.mean[k] - high[k]) / (1.0 + t * t).sqrt();
            *clearance = belly.height_m as f32 + lift;
        }
        self.settle(work, Layer::BellyClearance);
    }

    fn relative_elevation(&self, work: &mut Work) {
        let (true, Some(plane)) = (self.makes(Layer::RelativeElevation), &self.plane) else { return };
        let Work { tile, layers, .. } = work;
        let layer = &mut layers[slot(Layer::RelativeElevation)];
        for y in 0..tile.rows {
            for x in 0..tile.width {
                let position = self.geometry.position((tile.at[0] + y) as f64, (tile.at[1] + x) as f64);
                let height = self.datum + f64::from(tile.z[tile.index(y, x)]);
                layer[y * tile.width + x] = (height - plane.height_at(position)) as f32;
            }
        }
        self.settle(work, Layer::RelativeElevation);
    }

    fn normal_slope(&self, work: &mut Work) {
        let (true, Some(pairs), Some(plane)) = (self.makes(Layer::NormalSlope), &self.normals, &self.plane)
        else {
            return;
        };
        let Work { tile, layers, rises, cosines, .. } = work;
        let active = self.active(&work.active, &work.known_normals);
        let layer = &mut layers[slot(Layer::NormalSlope)];
        for y in 0..tile.rows {
            for x in (0..tile.cols).filter(|x| active[y * tile.width + x] != 0) {
                let centre = f64::from(tile.z[tile.index(y, x)]);
                rises.clear();
                let rise = |offset| f64::from(tile.z[tile.offset(y, x, offset)]) - centre;
                rises.extend(pairs.offsets.iter().map(|offset| rise(*offset)));
                let angle = pairs.median(rises, plane, cosines);
                layer[y * tile.width + x] = angle.map_or(f32::NAN, |angle| angle as f32);
            }
        }
    }
}

/// The distance from a threshold at which a value of `f32` decides, for heights up to `largest` over a length.
fn open_within(largest: f32, length: f64) -> f64 {
    ROUNDINGS * f64::from(f32::EPSILON) * f64::from(largest) / length
}

/// Replaces the active values that are within `open` of a limit.
fn decide(
    tile: &Tile,
    layer: &mut [f32],
    active: &[u8],
    limit: f64,
    open: f64,
    exact: impl Fn(usize, usize) -> f64,
) {
    let (low, high) = ((limit - open) as f32, (limit + open) as f32);
    for y in 0..tile.rows {
        for x in 0..tile.cols {
            let at = y * tile.width + x;
            if layer[at] >= low && layer[at] <= high && active[at] != 0 {
                layer[at] = towards(exact(y, x), limit);
            }
        }
    }
}

/// The `f32` next to a value, on the same side of a limit.
fn towards(value: f64, limit: f64) -> f32 {
    let rounded = value as f32;
    match (value > limit, f64::from(rounded) > limit) {
        (true, false) => rounded.next_up(),
        (false, true) => rounded.next_down(),
        _ => rounded,
    }
}

/// Takes pixels out that have a mark at one of some offsets.
fn exclude(tile: &Tile, marks: &[f32], offsets: &[(isize, isize)], known: &mut [u8]) {
    for (y, known) in known.chunks_exact_mut(tile.width).enumerate() {
        for &offset in offsets {
            let marks = &marks[tile.offset(y, 0, offset)..][..tile.width];
            known.iter_mut().zip(marks).for_each(|(known, mark)| *known &= u8::from(*mark <= 0.0));
        }
    }
}

/// Rows of the results.
struct Band<'a> {
    layers: [Option<&'a mut [f32]>; LAYERS],
    verdict: &'a mut [Verdict],
}

impl Band<'_> {
    /// Makes a tile unknown ground.
    fn leave(&mut self, col: usize, [rows, own]: [usize; 2], cols: usize) {
        for to in (0..rows).map(|y| y * cols + col) {
            for layer in self.layers.iter_mut().flatten() {
                layer[to..to + own].fill(f32::NAN);
            }
            self.verdict[to..to + own].fill(Verdict::Unknown);
        }
    }
}

/// Memory of one thread.
#[derive(Debug, Default)]
struct Work {
    tile: Tile,
    planes: Planes,
    stance: Stance,
    extremes: Extremes,
    layers: [Vec<f32>; LAYERS],
    verdict: Vec<Verdict>,
    known: Vec<u8>,
    known_disk: Vec<u8>,
    known_pads: Vec<u8>,
    known_belly: Vec<u8>,
    known_centre: Vec<u8>,
    known_normals: Vec<u8>,
    /// Heights above a centre, and the cosines of its normals.
    rises: Vec<f64>,
    cosines: Vec<f64>,
    /// Pixels whose verdict is still open.
    active: Vec<u8>,
    high: Vec<f32>,
    low: Vec<f32>,
    top: Vec<f32>,
    near: Vec<f32>,
    space: Vec<f32>,
}

impl Work {
    /// Copies the results of a tile to their place.
    fn hand_over(&self, band: &mut Band, cols: usize) {
        let Tile { rows, width, cols: own, at, .. } = self.tile;
        for y in 0..rows {
            let to = y * cols + at[1];
            for (layer, from) in band.layers.iter_mut().zip(&self.layers) {
                if let Some(layer) = layer {
                    layer[to..to + own].copy_from_slice(&from[y * width..][..own]);
                }
            }
            band.verdict[to..to + own].copy_from_slice(&self.verdict[y * width..][..own]);
        }
    }
}
