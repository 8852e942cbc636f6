//! Every numeric parameter of an axis, with its accessor.

use std::sync::LazyLock;

use super::compensation::{Filter, LowPass, Notch};
use super::controller::{CascadeGains, PPiGains, PidGains};
use super::effects::{Coulomb, Friction, LuGre};
use super::{AxisParameters, ControllerGains, Drive, DriveModel, Mechanics, Pdff, Plant};
use crate::parameters::{Entry, Parameter, Parameters};

type Get<T> = Box<dyn Fn(&T) -> Option<f64> + Send + Sync>;
type Set<T> = Box<dyn Fn(&mut T, f64) -> bool + Send + Sync>;

/// Where the value of a parameter is kept.
enum Access {
    /// In plant, drive and PDFF gains.
    Model(Get<AxisParameters>, Set<AxisParameters>),
    /// In controller, effects and compensation.
    Drive(Get<DriveModel>, Set<DriveModel>),
    /// Only in the file: other values follow from it.
    File,
}

/// A numeric parameter of an axis.
pub struct AxisParameter {
    /// The parameter; its key is the one below `axes.x`.
    pub parameter: &'static Parameter,
    access: Access,
}

impl std::fmt::Debug for AxisParameter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("AxisParameter").field(self.parameter).finish()
    }
}

impl AxisParameter {
    /// The parameter of this key below `axes.x`.
    pub fn find(key: &str) -> Option<&'static Self> {
        axis_parameters().iter().find(|known| known.parameter.key == key)
    }

    /// Its value; none where the axis has no such table, or where other values were made of it.
    pub fn get(&self, axis: &AxisParameters, drive: &DriveModel) -> Option<f64> {
        match &self.access {
            Access::Model(get, _) => get(axis),
            Access::Drive(get, _) => get(drive),
            Access::File => None,
        }
    }

    /// Changes it, unchecked; whether the axis has it. What was made of the former value stays as it is: the loops of a controller whose
    /// gains are those of `pdff`.
    pub fn set(&self, axis: &mut AxisParameters, drive: &mut DriveModel, value: f64) -> bool {
        match &self.access {
            Access::Model(_, set) => set(axis, value),
            Access::Drive(_, set) => set(drive, value),
            Access::File => false,
        }
    }

    /// Changes it in the axis' model; whether it is there. A batch takes many models of one drive.
    pub fn set_in_model(&self, axis: &mut AxisParameters, value: f64) -> bool {
        matches!(&self.access, Access::Model(_, set) if set(axis, value))
    }

    /// Whether it is a value of the axis' model: plant, drive, PDFF gains.
    pub fn is_of_model(&self) -> bool {
        matches!(self.access, Access::Model(..))
    }
}

/// Every numeric parameter of an axis, in the order of the reference. A new table is added in this file, a new parameter of a table beside
/// its field only.
pub fn axis_parameters() -> &'static [AxisParameter] {
    static ALL: LazyLock<Vec<AxisParameter>> = LazyLock::new(all);
    &ALL
}

fn all() -> Vec<AxisParameter> {
    let mut list = List::default();
    list.model::<Plant>(|axis| &axis.plant, |axis| &mut axis.plant);
    list.file::<Mechanics>();
    list.model::<Drive>(|axis| &axis.drive, |axis| &mut axis.drive);
    list.model::<Pdff>(|axis| &axis.pdff, |axis| &mut axis.pdff);
    macro_rules! variant {
        ($of:ty, $enum:ident::$variant:ident, $($way:tt)+) => {
            list.drive::<$of>(
                |drive| match &drive.$($way)+ {
                    $enum::$variant(value) => Some(value),
                    _ => None,
                },
                |drive| match &mut drive.$($way)+ {
                    $enum::$variant(value) => Some(value),
                    _ => None,
                },
            )
        };
    }
    variant!(PPiGains, ControllerGains::PPi, controller);
    variant!(CascadeGains, ControllerGains::Cascade, controller);
    variant!(PidGains, ControllerGains::Pid, controller);
    macro_rules! option {
        ($($way:tt)+) => {
            list.drive(|drive| drive.$($way)+.as_ref(), |drive| drive.$($way)+.as_mut())
        };
    }
    option!(effects.mismatch);
    option!(effects.encoder);
    option!(effects.noise);
    option!(effects.delay);
    option!(effects.dac);
    option!(effects.current_loop);
    option!(effects.two_mass);
    list.drive::<Coulomb>(
        |drive| match &drive.effects.friction {
            Some(Friction::Coulomb(curve)) => Some(curve),
            _ => None,
        },
        |drive| match &mut drive.effects.friction {
            Some(Friction::Coulomb(curve)) => Some(curve),
            _ => None,
        },
    );
    list.drive::<LuGre>(
        |drive| match &drive.effects.friction {
            Some(Friction::LuGre(lu_gre)) => Some(lu_gre),
            _ => None,
        },
        |drive| match &mut drive.effects.friction {
            Some(Friction::LuGre(lu_gre)) => Some(lu_gre),
            _ => None,
        },
    );
    option!(effects.backlash);
    list.drive(|drive| Some(&drive.effects.integration), |drive| Some(&mut drive.effects.integration));
    list.drive::<Notch>(
        |drive| {
            drive
                .compensation
                .filters
                .iter()
                .find_map(|filter| if let Filter::Notch(it) = filter { Some(it) } else { None })
        },
        |drive| {
            let mut filters = drive.compensation.filters.iter_mut();
            filters.find_map(|filter| if let Filter::Notch(it) = filter { Some(it) } else { None })
        },
    );
    list.drive::<LowPass>(
        |drive| {
            drive
                .compensation
                .filters
                .iter()
                .find_map(|filter| if let Filter::LowPass(it) = filter { Some(it) } else { None })
        },
        |drive| {
            let mut filters = drive.compensation.filters.iter_mut();
            filters.find_map(|filter| if let Filter::LowPass(it) = filter { Some(it) } else { None })
        },
    );
    option!(compensation.acceleration);
    option!(compensation.friction);
    option!(compensation.backlash);
    list.0
}

#[derive(Default)]
struct List(Vec<AxisParameter>);

impl List {
    fn add<T: Parameters>(&mut self, access: impl Fn(&'static Entry<T>) -> Access) {
        let entries = T::ENTRIES.iter();
        self.0.extend(entries.map(|entry| AxisParameter { parameter: &entry.parameter, access: access(entry) }));
    }

    fn model<T: Parameters>(&mut self, of: fn(&AxisParameters) -> &T, of_mut: fn(&mut AxisParameters) -> &mut T) {
        self.add(|entry: &'static Entry<T>| {
            Access::Model(
                Box::new(move |axis| (entry.get)(of(axis))),
                Box::new(move |axis, value| (entry.set)(of_mut(axis), value)),
            )
        });
    }

    fn drive<T: Parameters>(
        &mut self,
        of: fn(&DriveModel) -> Option<&T>,
        of_mut: fn(&mut DriveModel) -> Option<&mut T>,
    ) {
        self.add(|entry: &'static Entry<T>| {
            Access::Drive(
                Box::new(move |drive| (entry.get)(of(drive)?)),
                Box::new(move |drive, value| of_mut(drive).is_some_and(|table| (entry.set)(table, value))),
            )
        });
    }

    fn file<T: Parameters>(&mut self) {
        self.add(|_: &'static Entry<T>| Access::File);
    }
}
