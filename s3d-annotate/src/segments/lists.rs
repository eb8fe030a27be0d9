//! Lists of numbers, one after the other.

/// A list for each number from 0.
#[derive(Debug)]
pub(crate) struct Lists {
    /// Where each list begins, and where the last one ends.
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    /// Makes lists of pairs of a list and an entry. The entries of a list keep their order.
    pub(crate) fn of(count: usize, pairs: impl Iterator<Item = (u32, u32)> + Clone) -> Self {
        let mut starts = vec![0u32; count + 1];
        for (list, _) in pairs.clone() {
            starts[list as usize + 1] += 1;
        }
        for i in 0..count {
            starts[i + 1] += starts[i];
        }

        let mut next = starts.clone();
        let mut entries = vec![0; starts[count] as usize];
        for (list, entry) in pairs {
            let place = &mut next[list as usize];
            entries[*place as usize] = entry;
            *place += 1;
        }
        Self { starts, entries }
    }

    pub(crate) fn list(&self, number: u32) -> &[u32] {
        let [start, end] = [0, 1].map(|i| self.starts[number as usize + i] as usize);
        &self.entries[start..end]
    }
}
