//! The part of the raw handles that is the same for all methods.

use std::cell::RefCell;
use std::rc::Rc;

use js_sys::Uint8Array;
use wasm_bindgen::prelude::JsValue;

use super::convert::{bytes, now, to_js, with_overrides};
use super::error::Failure;
use vesicle::methods::{Method, MethodError, Parameters, StepReport};

/// Returns a new model with a clock for its reports, shared between its raw handle and the live meshes of its surfaces.
pub fn shared<M: Method>(model: Result<M, MethodError>) -> Result<Rc<RefCell<M>>, Failure> {
    let mut model = model?;
    model.set_clock(now);
    Ok(Rc::new(RefCell::new(model)))
}

/// Makes `iterations` steps; returns the `StepReport`. See `step` of [`method_bindings!`], as for the functions below.
pub fn step(model: &mut impl Method, iterations: u32) -> Result<JsValue, Failure> {
    reported(model.steps(iterations))
}

/// Returns the `StepReport` of a step, or an object with the boxes that it needs.
pub fn reported(report: Result<StepReport, MethodError>) -> Result<JsValue, Failure> {
    match report {
        #[cfg(all(feature = "sparse", feature = "deformable"))]
        Err(MethodError::NeedsData { needs }) => super::sparse::needs(&needs),
        report => to_js(&report?),
    }
}

/// Returns the parameters as a plain object.
pub fn params(model: &impl Method) -> Result<JsValue, Failure> {
    to_js(model.params())
}

/// Sets the parameters that are properties of a plain object.
pub fn set_params(model: &mut impl Method, given: &JsValue) -> Result<(), Failure> {
    let params = with_overrides(model.params(), given)?;
    Ok(model.set_params(params)?)
}

/// Replaces the run by a saved one.
pub fn restore(model: &mut impl Method, state: &Uint8Array) -> Result<(), Failure> {
    Ok(model.restore(&bytes(state)?)?)
}

/// Returns the descriptions of all parameters as an array of plain objects.
pub fn param_specs<M: Method>() -> Result<JsValue, Failure> {
    to_js(&M::Params::specs())
}

/// Exports what all methods have: functions of the raw handle `$Raw`, whose `ready` returns the `$Model`, and the function
/// that JavaScript knows as `$specs`, which describes the parameters.
macro_rules! method_bindings {
    ($Raw:ident, $Model:ident, $specs:ident) => {
        #[wasm_bindgen]
        impl $Raw {
            /// Makes `iterations` steps, or fewer if the model is done before; returns the `StepReport` of the last
            /// step, with the events of all these steps. If bricks of a sparse volume are missing for the first one, nothing
            /// changes, and an object with the boxes it `needs` is returned.
            pub fn step(&self, iterations: u32) -> Result<JsValue, JsValue> {
                Ok($crate::method::step(&mut *self.ready(), iterations)?)
            }

            /// Returns the current values of all parameters of the model, as a plain object.
            pub fn params(&self) -> Result<JsValue, JsValue> {
                Ok($crate::method::params(&*self.ready())?)
            }

            /// Sets the parameters that are properties of the plain object `params`, and keeps the others; all are
            /// validated together before any is changed.
            #[wasm_bindgen(js_name = setParams)]
            pub fn set_params(&self, params: &JsValue) -> Result<(), JsValue> {
                Ok($crate::method::set_params(&mut *self.ready(), params)?)
            }

            /// Returns the state of the run as bytes, without the input that the model was made of, from which
            /// `restore` continues it.
            pub fn save(&self) -> Vec<u8> {
                self.ready().save()
            }

            /// Replaces the run by one that `save` returned, if this model was made of the same input, else fails; the
            /// run then continues with the same results, bit for bit.
            pub fn restore(&self, state: &js_sys::Uint8Array) -> Result<(), JsValue> {
                Ok($crate::method::restore(&mut *self.ready(), state)?)
            }
        }

        /// Returns the descriptions of the method's parameters, from which user interfaces build their controls.
        #[wasm_bindgen(js_name = $specs)]
        pub fn param_specs() -> Result<JsValue, JsValue> {
            Ok($crate::method::param_specs::<$Model>()?)
        }
    };
}

pub(super) use method_bindings;
