//! Reads the true and the predicted depth of an image.

use crate::images::predictions::Predicted;
use crate::images::read::{self, Holds, Places};
use crate::task::Task;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_gray16;

/// What is read of an image.
pub(super) struct Form {
    /// Selects pixels, given the width and the height of the image.
    pub(super) places: fn([u32; 2]) -> Places,
    /// Whether predictions are metres.
    pub(super) is_metric: bool,
    /// Whether a pixel with this truth in metres is evaluated. Missing truth is 0.
    pub(super) is_evaluated: fn(f64) -> bool,
}

/// Truth and prediction at the pixels of the evaluation, and the width and the height of these.
pub(super) struct Both {
    pub(super) size: [u32; 2],
    /// Metres. Missing truth is 0.
    pub(super) truth: Vec<f64>,
    pub(super) prediction: Vec<f64>,
}

/// Reads truth and prediction. Refuses a file without a prediction where the truth is evaluated.
pub(super) fn both(task: &Task<'_>, predicted: &Predicted, form: &Form) -> s3d_dataset::Result<Both> {
    let units = task.data.options().depth_units;
    let image = read::gray16(task.data, &predicted.image, Domain::Depth)?;
    let places = (form.places)([image.width(), image.height()]);

    let truth: Vec<f64> = places
        .sample(image.pixels())
        .into_iter()
        .map(|value| units.metres(value).unwrap_or(0.0))
        .collect();

    let file = &predicted.file;
    let (size, prediction) = if read::is_png(file) {
        let image = read_gray16(file)?;
        let size = [image.width(), image.height()];
        read::check_size(file, size, &places.sizes())?;
        let values = places.sample_prediction(size, image.into_vec()).into_iter();
        // Without a unit, the largest number is a number like others.
        let number = |value: u16| {
            if form.is_metric {
                units.metres(value).unwrap_or(f64::NAN)
            } else {
                f64::from(value)
            }
        };
        (size, values.map(number).collect())
    } else {
        let holds = if form.is_metric {
            Holds::Floats(1)
        } else {
            Holds::Numbers
        };
        let (size, values) = read::array(file, &places.sizes(), holds)?;
        (size, places.sample_prediction(size, values))
    };

    let wrong = |(truth, prediction): (&f64, &f64)| (form.is_evaluated)(*truth) && !prediction.is_finite();
    if let Some(at) = truth.iter().zip(&prediction).position(wrong) {
        let [x, y] = places.place(size, at);
        let found = if read::is_png(file) {
            "65535 (missing)".to_owned()
        } else {
            prediction[at].to_string()
        };
        let message = format!("has {found} in column {x}, row {y}, which is evaluated: predict every pixel");
        return Err(FileError::format(file, message).into());
    }
    Ok(Both { size: places.evaluated(), truth, prediction })
}
