pub(crate) mod account;
pub(crate) mod assets;
pub(crate) mod label_list;
pub(crate) mod listing;
pub(crate) mod manifest;
pub(crate) mod records;
pub(crate) mod statistics;
pub(crate) mod summary;
