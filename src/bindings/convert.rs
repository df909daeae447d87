//! Conversion of JavaScript's arrays and objects to the core's types and back. Everything is copied: a view into the
//! module's memory would become invalid when the memory grows.

use js_sys::{Float32Array, Float64Array, Reflect, Uint8Array, Uint32Array};
use serde::Serialize;
use serde_wasm_bindgen::Serializer;
use wasm_bindgen::JsCast;
use wasm_bindgen::prelude::{JsValue, wasm_bindgen};

use super::error::Failure;
use vesicle::io::WriteOptions;
use vesicle::math::{DAffine3, DVec3, Vec2, Vec3};
use vesicle::mesh::WorldPositions;
use vesicle::methods::{ParamInput, ParamSpec, Parameters};
use vesicle::volume::{LengthUnit, Space};

#[wasm_bindgen]
extern "C" {
    /// Returns the milliseconds since the start of the page, worker or process (`performance.now`); the models measure
    /// with it how long their steps take.
    #[wasm_bindgen(js_namespace = performance)]
    pub fn now() -> f64;
}

/// Returns an array of `length` elements that `copy` fills; a `too-large` failure if there is not enough memory.
pub fn copy_array<T: Clone + Default>(length: u32, copy: impl FnOnce(&mut [T])) -> Result<Vec<T>, Failure> {
    let mut values = Vec::new();
    let bytes = u64::from(length).saturating_mul(size_of::<T>() as u64);
    values.try_reserve_exact(length as usize).map_err(|_| Failure::too_large(bytes))?;
    values.resize(length as usize, T::default());
    copy(&mut values);
    Ok(values)
}

/// Copies the bytes of a file from a `Uint8Array`.
pub fn bytes(array: &Uint8Array) -> Result<Vec<u8>, Failure> {
    copy_array(array.length(), |out| array.copy_to(out))
}

/// Copies the numbers of a `Float32Array`.
pub fn floats(array: &Float32Array) -> Result<Vec<f32>, Failure> {
    copy_array(array.length(), |out| array.copy_to(out))
}

/// Copies the numbers of a `Float64Array`.
pub fn doubles(array: &Float64Array) -> Result<Vec<f64>, Failure> {
    copy_array(array.length(), |out| array.copy_to(out))
}

/// Converts an array of coordinates, x, y and z of each point in turn, to points. An incomplete last triple is dropped;
/// the TypeScript side has checked the length.
pub fn points(array: &Float32Array) -> Result<Vec<Vec3>, Failure> {
    Ok(floats(array)?.chunks_exact(3).map(Vec3::from_slice).collect())
}

/// Converts an array of coordinates in world space, in single or double precision, to positions and the origin that they
/// are relative to.
pub fn located(array: &JsValue) -> Result<(Vec<Vec3>, DVec3), Failure> {
    Ok(world_points(array)?.into_iter().collect::<WorldPositions>().relative())
}

/// Converts an array of coordinates in world space, in single or double precision, to points.
pub fn world_points(array: &JsValue) -> Result<Vec<DVec3>, Failure> {
    match array.dyn_ref::<Float32Array>() {
        Some(array) => Ok(points(array)?.iter().map(|p| p.as_dvec3()).collect()),
        None => double_points(array),
    }
}

/// Converts an array of coordinates in world space, in single or double precision, to positions relative to `origin`.
pub fn relative(array: &JsValue, origin: DVec3) -> Result<Vec<Vec3>, Failure> {
    match array.dyn_ref::<Float32Array>() {
        Some(array) if origin == DVec3::ZERO => points(array),
        Some(array) => Ok(points(array)?.iter().map(|p| (p.as_dvec3() - origin).as_vec3()).collect()),
        None => Ok(double_points(array)?.iter().map(|&p| (p - origin).as_vec3()).collect()),
    }
}

/// Converts positions relative to `origin` to an array of x, y and z of each in world space, in double precision if the
/// origin is not 0.
pub fn in_world(positions: &[Vec3], origin: DVec3) -> JsValue {
    if origin == DVec3::ZERO {
        return Float32Array::from(packed(positions).as_slice()).into();
    }
    let world: Vec<f64> = positions.iter().flat_map(|p| (p.as_dvec3() + origin).to_array()).collect();
    Float64Array::from(world.as_slice()).into()
}

fn double_points(array: &JsValue) -> Result<Vec<DVec3>, Failure> {
    let numbers = doubles(array.unchecked_ref())?;
    Ok(numbers.chunks_exact(3).map(DVec3::from_slice).collect())
}

/// Converts an array of u and v of each vertex in turn to texture coordinates; an incomplete last pair is dropped.
pub fn coordinates(array: &Float32Array) -> Result<Vec<Vec2>, Failure> {
    Ok(floats(array)?.chunks_exact(2).map(Vec2::from_slice).collect())
}

/// Converts an array of u and v of the three corners of each triangle in turn to texture coordinates; an incomplete last
/// triangle is dropped.
pub fn corner_coordinates(array: &Float32Array) -> Result<Vec<[Vec2; 3]>, Failure> {
    let all = coordinates(array)?;
    let (corners, _) = all.as_chunks::<3>();
    Ok(corners.to_vec())
}

/// Converts an array of the three vertex indices of each triangle in turn to triangles; an incomplete last triple is
/// dropped.
pub fn triangles(array: &Uint32Array) -> Result<Vec<[u32; 3]>, Failure> {
    let indices = copy_array(array.length(), |out| array.copy_to(out))?;
    let (triangles, _) = indices.as_chunks::<3>();
    Ok(triangles.to_vec())
}

/// Converts three numbers to a point; an error for another count.
pub fn point(values: &[f64]) -> Result<DVec3, Failure> {
    match values {
        [x, y, z] => Ok(DVec3::new(*x, *y, *z)),
        _ => Err(Failure::invalid("point", &format!("must be 3 numbers, got {}", values.len()))),
    }
}

/// Converts points to an array of x, y and z of each in turn.
pub fn packed(points: &[Vec3]) -> Vec<f32> {
    points.iter().flat_map(|point| point.to_array()).collect()
}

/// Converts texture coordinates to an array of u and v of each in turn.
pub fn flat(coordinates: &[Vec2]) -> Vec<f32> {
    coordinates.iter().flat_map(|uv| uv.to_array()).collect()
}

/// Returns the sixteen numbers of the 4 × 4 matrix of an affine transform, column by column.
pub fn columns(affine: DAffine3) -> Vec<f64> {
    let columns = affine.to_cols_array();
    let (columns, _) = columns.as_chunks::<3>();
    let last_row = [0.0, 0.0, 0.0, 1.0];
    columns.iter().zip(last_row).flat_map(|(&[x, y, z], w)| [x, y, z, w]).collect()
}

/// Returns the name of a space of world coordinates.
pub fn space_name(space: Space) -> &'static str {
    match space {
        Space::Ras => "RAS",
        Space::Lps => "LPS",
    }
}

/// Returns the space of a name, as [`space_name`] returns it; `None` for any other.
pub fn space_named(name: &str) -> Option<Space> {
    [Space::Ras, Space::Lps].into_iter().find(|&space| space_name(space) == name)
}

/// Returns how a mesh is written to a file: notes, the names of its space and of that in the file, and of its unit, each
/// empty if it is not given.
pub fn write_options<'a>(notes: &'a str, [space, written_as, unit]: [&str; 3]) -> WriteOptions<'a> {
    let [space, written_as] = [space, written_as].map(space_named);
    WriteOptions { notes, space, written_as, unit: unit_named(unit) }
}

/// Returns the name of a unit of length; that of the unknown one is empty.
pub fn unit_name(unit: LengthUnit) -> &'static str {
    match unit {
        LengthUnit::Unknown => "",
        LengthUnit::Metre => "m",
        LengthUnit::Millimetre => "mm",
        LengthUnit::Micrometre => "um",
    }
}

/// Returns the unit of length of a name, as [`unit_name`] returns it; unknown for any other.
pub fn unit_named(name: &str) -> LengthUnit {
    let known = [LengthUnit::Metre, LengthUnit::Millimetre, LengthUnit::Micrometre];
    known.into_iter().find(|&unit| unit_name(unit) == name).unwrap_or_default()
}

/// Converts a serialisable value to plain objects and arrays, in which `None` is `undefined`.
pub fn to_js<T: Serialize + ?Sized>(value: &T) -> Result<JsValue, Failure> {
    value
        .serialize(&Serializer::new().serialize_maps_as_objects(true))
        .map_err(|error| Failure::invalid("result", &error.to_string()))
}

/// Returns a copy of `current` in which the properties of the JavaScript object `given` replace the parameters of the same
/// names.
///
/// Properties that are `undefined` are ignored.
///
/// # Errors
/// `invalid-argument` with the name of the property, if there is no parameter of that name or its value has the wrong
/// type.
pub fn with_overrides<P: Parameters>(current: &P, given: &JsValue) -> Result<P, Failure> {
    let mut params = current.clone();
    for key in js_sys::Object::keys(given.unchecked_ref::<js_sys::Object>()).iter() {
        let value = Reflect::get(given, &key).unwrap_or(JsValue::UNDEFINED);
        let name = key.as_string().unwrap_or_default();
        if !value.is_undefined() && !params.set(&name, &input(&value)) {
            return Err(refusal(&name, &value, &P::specs()));
        }
    }
    Ok(params)
}

/// Converts a JavaScript value given for a parameter.
fn input(value: &JsValue) -> ParamInput {
    if let Some(number) = value.as_f64() {
        ParamInput::Number(number)
    } else if let Some(word) = value.as_string() {
        ParamInput::Word(word)
    } else {
        value.as_bool().map_or(ParamInput::Other, ParamInput::Boolean)
    }
}

/// Returns the failure about a value of the wrong type, or about a parameter that is not among those that `specs`
/// describes; the message lists the names of these.
fn refusal(name: &str, value: &JsValue, specs: &[ParamSpec]) -> Failure {
    let problem = match specs.iter().find(|spec| spec.name == name) {
        Some(spec) => {
            let shown = match input(value) {
                ParamInput::Number(number) => number.to_string(),
                ParamInput::Word(word) => format!("\"{word}\""),
                ParamInput::Boolean(on) => on.to_string(),
                ParamInput::Other if value.is_null() => "null".into(),
                ParamInput::Other => value.js_typeof().as_string().unwrap_or_default(),
            };
            format!("must be {}, got {shown}", spec.expected())
        }
        None => {
            let names: Vec<&str> = specs.iter().map(|spec| spec.name).collect();
            format!("unknown parameter; must be one of {}", names.join(", "))
        }
    };
    Failure::invalid(name, &problem)
}
