//! The classes of the labels of a data set, and of the numbers in predictions.

use crate::ConfusionTable;
use crate::error::Result;
use crate::images::class::confusion::Confusion;
use crate::images::predictions::Predicted;
use crate::images::read::{self, Holds, Places};
use crate::tables::Rows;
use crate::task::Task;
use s3d_dataset::DataSet;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::image::read_numbers8;
use s3d_label::{LabelId, Taxonomy};
use std::fs;
use std::path::Path;

/// The endings of files that predict classes.
pub(super) const ENDINGS: [&str; 3] = ["png", "npy", "npz"];
/// The file with the class of each number of predictions.
pub(super) const LIST: &str = "classes.txt";

/// What the indices of labels and the numbers of predictions stand for. Classes are numbers below `count`.
pub(super) struct Classes<'a> {
    taxonomy: &'a Taxonomy,
    pub(super) count: usize,
    /// The class of each label; `None` where it has none.
    of_labels: Vec<Option<u8>>,
    /// The class of each number of predictions.
    of_numbers: Vec<u8>,
}

impl<'a> Classes<'a> {
    /// Reads them from the data set, and from the list beside the predictions if there is one.
    pub(super) fn of(task: &Task<'a>) -> Result<Self> {
        let Some((taxonomy, table)) = task.data.taxonomy().zip(task.data.labels()?) else {
            return Err(task.unlabelled());
        };
        let class = |id: usize| table.class_of(LabelId(id as u32)).map(|class| class.index() as u8);
        Ok(Self {
            taxonomy,
            count: taxonomy.classes().len(),
            of_labels: (0..table.len()).map(class).collect(),
            of_numbers: of_numbers(&task.predictions.join(LIST), taxonomy)?,
        })
    }

    /// Returns the class of the label at an index; `None` if it has none.
    ///
    /// # Errors
    /// Returns what is wrong if there is no such label.
    pub(super) fn of_label(&self, index: u32) -> Result<Option<u8>, String> {
        let class = self.of_labels.get(index as usize).copied();
        class.ok_or_else(|| format!("has the index {index}, and there are {} labels", self.of_labels.len()))
    }

    /// Returns the class of a pixel of a `semantic` image; `None` if it has no label.
    ///
    /// # Errors
    /// As [`of_label`](Self::of_label).
    fn of_pixel(&self, [r, g, b]: [u8; 3]) -> Result<Option<u8>, String> {
        // Indices have 16 bits. Higher numbers are pixels that show nothing.
        if r == 0 {
            self.of_label(u16::from_be_bytes([g, b]).into())
        } else {
            Ok(None)
        }
    }

    /// Returns the class of a number of predictions; `None` if it stands for none.
    pub(super) fn of_number(&self, number: f64) -> Option<u8> {
        (number >= 0.0)
            .then(|| self.of_numbers.get(number as usize).copied())
            .flatten()
    }

    /// Returns the sum of what [`Confusion::counted`] returned for images.
    pub(super) fn sum<'i>(&self, images: impl IntoIterator<Item = &'i Vec<(u32, u32)>>) -> Confusion {
        let mut sum = Confusion::new(self.count);
        images.into_iter().for_each(|counted| sum.add_counted(counted));
        sum
    }

    /// Returns counts with the names of the classes.
    pub(super) fn table(&self, confusion: &Confusion) -> ConfusionTable {
        let names = self.taxonomy.classes().iter().map(|class| class.name().to_owned());
        ConfusionTable { classes: names.collect(), counts: confusion.rows() }
    }

    /// Returns the rows of the classes in a table, given the scores of each class.
    pub(super) fn rows(&self, scores: impl Iterator<Item = Vec<f64>>) -> Rows {
        let names = self.taxonomy.classes().iter().map(|class| class.name().to_owned());
        names.zip(scores).collect()
    }

    /// Hands on the true and the predicted class of each pixel of an image, row by row; `None` where it has
    /// no label. Returns the width and the height.
    pub(super) fn pair(
        &self,
        data: &DataSet,
        predicted: &Predicted,
        mut put: impl FnMut(Option<[u8; 2]>),
    ) -> s3d_dataset::Result<[u32; 2]> {
        let truth = read::rgb8(data, &predicted.image, Domain::Semantic)?;
        let places = Places::all([truth.width(), truth.height()]);
        let (size, numbers) = self.numbers(&predicted.file, &places)?;

        for (at, (pixel, number)) in truth.pixels().iter().zip(&numbers).enumerate() {
            let class = self.of_pixel(*pixel).map_err(|message| {
                FileError::format(&predicted.image.path(data.layout(), Domain::Semantic), message)
            })?;
            let Some(class) = class else {
                put(None);
                continue;
            };
            match self.of_number(*number) {
                Some(guess) => put(Some([class, guess])),
                None => return Err(self.no_class(&predicted.file, *number, places.place(size, at))),
            }
        }
        Ok(size)
    }

    /// Reads the numbers of a prediction at the evaluated pixels, and the size that it has.
    pub(super) fn numbers(&self, file: &Path, places: &Places) -> s3d_dataset::Result<([u32; 2], Vec<f64>)> {
        let sizes = places.sizes();
        if !read::is_png(file) {
            let (size, numbers) = read::array(file, &sizes, Holds::Classes(self.of_numbers.len()))?;
            return Ok((size, places.sample_prediction(size, numbers)));
        }
        let image = read_numbers8(file)?;
        let size = [image.width(), image.height()];
        read::check_size(file, size, &sizes)?;
        let numbers = places.sample_prediction(size, image.into_vec());
        Ok((size, numbers.into_iter().map(f64::from).collect()))
    }

    /// Returns the error for an evaluated pixel whose number is no class.
    pub(super) fn no_class(&self, file: &Path, number: f64, [x, y]: [u32; 2]) -> s3d_dataset::Error {
        let message = format!(
            "has {number} in column {x}, row {y}, which is evaluated: numbers of classes are below {}",
            self.of_numbers.len(),
        );
        FileError::format(file, message).into()
    }
}

/// Returns the class of each number of predictions. A file may list them, one on each line; otherwise they
/// have the order of the taxonomy.
fn of_numbers(path: &Path, taxonomy: &Taxonomy) -> Result<Vec<u8>> {
    let own: Vec<u8> = (0..taxonomy.classes().len()).map(|index| index as u8).collect();
    if !path.exists() {
        return Ok(own);
    }
    let text = fs::read_to_string(path).map_err(|e| FileError::io(path, "read", e))?;
    let mut meaning: Vec<u8> = Vec::new();
    for (line, name) in (1..).zip(text.lines()) {
        let class = taxonomy
            .class(name.trim())
            .map_err(|e| FileError::line(path, line, e.to_string()))?;
        if meaning.contains(&(class.index() as u8)) {
            return Err(FileError::line(path, line, format!("{class} stands there twice")).into());
        }
        meaning.push(class.index() as u8);
    }
    Ok(meaning)
}
