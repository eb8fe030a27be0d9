//! A run of an export, a shard or a merge: how it looks at OUT, begins there, and ends.

use crate::account::Account;
use crate::context::Context;
use crate::error::Result;
use crate::export::finish::Totals;
use crate::record::manifest::Manifest;
use crate::record::request::Request;
use crate::store::lock::Sharing;
use crate::store::output::{self, Begin, Session};
use crate::store::state::OutputState;
use crate::summary::{Summary, Unlabelled, ViewTally};
use s3d_io::dataset::Layout;

/// What an export writes to.
pub(crate) struct Target<'a> {
    pub(crate) layout: Layout,
    /// Whether OUT may hold something already.
    pub(crate) overwrite: bool,
    /// Names in OUT that do not count.
    pub(crate) allowed: Vec<&'a str>,
}

/// A run into OUT, from its first look at the folder to the summary.
pub(crate) struct Run<'a> {
    pub(crate) account: Account<'a>,
    pub(crate) ctx: &'a Context,
    target: &'a Target<'a>,
}

impl<'a> Run<'a> {
    pub(crate) fn new(ctx: &'a Context, target: &'a Target<'a>) -> Self {
        Self { account: Account::new(ctx), ctx, target }
    }

    /// Where the data set lies.
    pub(crate) fn layout(&self) -> &'a Layout {
        &self.target.layout
    }

    /// Reads what OUT holds, and refuses to touch what is not ours.
    pub(crate) fn look(&self) -> Result<OutputState> {
        let Target { layout, overwrite, allowed } = self.target;
        let state = OutputState::read(layout)?;
        state.check(self.ctx, layout, *overwrite, allowed)?;
        Ok(state)
    }

    /// Takes the lock of OUT, which held `state` before, and begins or continues the request. Returns `None`,
    /// and says so, if the data set is there already.
    pub(crate) fn begin(
        &self,
        state: &OutputState,
        request: &Request,
        manifest: &Manifest,
        sharing: Sharing,
    ) -> Result<Option<Session>> {
        let Target { layout, overwrite, .. } = self.target;
        let begin = match sharing {
            Sharing::Alone => output::begin(layout, state, *overwrite, request, manifest, &self.account)?,
            Sharing::Shards => output::begin_shard(self.ctx, layout, *overwrite, request, manifest)?,
        };
        match begin {
            Begin::Session(session) => Ok(Some(session)),
            Begin::NothingToDo => {
                self.tell_complete();
                Ok(None)
            }
        }
    }

    /// Says that there is nothing to do.
    pub(crate) fn tell_complete(&self) {
        self.ctx.info(format_args!(
            "{}: the data set is complete; nothing to do",
            self.layout().root().display()
        ));
    }

    /// Returns the summary of the complete data set.
    pub(crate) fn finish(self, request: &Request, made: &Totals) -> Summary {
        self.account.set_files(made.files, made.bytes);
        self.summarize(request, made.locations, made.views, made.unlabelled)
    }

    /// Returns the summary of a run.
    pub(crate) fn summarize(
        self,
        request: &Request,
        locations: usize,
        views: ViewTally,
        unlabelled: Option<Unlabelled>,
    ) -> Summary {
        let root = self.layout().root().display().to_string();
        self.account
            .summarize(&root, request.areas.len(), locations, views, unlabelled)
    }
}
