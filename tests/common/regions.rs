//! Regions in plan, in few words.

use nalgebra::Vector2;
use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use servosim::toolpath::guide::{Area, Contour, GuideError, Piece, Region};

pub type Point = Vector2<f64>;
pub type Random = Xoshiro256PlusPlus;

pub fn p(x: f64, y: f64) -> Point {
    Point::new(x, y)
}

pub fn line(start_mm: Point, end_mm: Point) -> Piece {
    Piece::Line { start_mm, end_mm }
}

pub fn arc(start_mm: Point, end_mm: Point, centre_mm: Point, counterclockwise: bool) -> Piece {
    Piece::Arc { start_mm, end_mm, centre_mm, counterclockwise }
}

pub fn polygon(points: &[[f64; 2]]) -> Result<Contour, GuideError> {
    let points: Vec<Point> = points.iter().copied().map(Point::from).collect();
    Contour::polygon(&points)
}

pub fn region(points: &[[f64; 2]]) -> Region {
    Region::new(polygon(points).unwrap(), Vec::new()).unwrap()
}

pub fn rectangle(x: f64, y: f64, width: f64, height: f64) -> [[f64; 2]; 4] {
    [[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
}

#[track_caller]
pub fn near(a: f64, b: f64, tolerance: f64) {
    assert!((a - b).abs() <= tolerance, "{a} is not {b} within {tolerance}");
}

pub fn total(areas: &[Area]) -> f64 {
    areas.iter().map(Area::area_mm2).sum()
}

pub fn between(random: &mut Random, low: f64, high: f64) -> f64 {
    low + (high - low) * random.random::<f64>()
}

pub fn random(seed: u64) -> Random {
    Random::seed_from_u64(seed)
}

pub fn count(random: &mut Random, low: usize, high: usize) -> usize {
    random.random_range(low..=high)
}
