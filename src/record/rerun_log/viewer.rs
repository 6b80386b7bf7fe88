//! This module gives access to the files of the browser viewer, which are part of the binary unless
//! it was built without the feature `viewer`.

use axum::Router;

/// Adds the files of the Rerun viewer, `re_viewer.js` and `re_viewer_bg.wasm`, to the routes of a
/// page; `None` if this build lacks them.
#[cfg(feature = "viewer")]
pub fn with_viewer<S: Clone + Send + Sync + 'static>(routes: Router<S>) -> Option<Router<S>> {
    use crate::web::{file, kind};
    use re_web_viewer_server::WebViewerData;
    use std::sync::OnceLock;
    static FILES: OnceLock<Option<WebViewerData>> = OnceLock::new();
    let files = FILES.get_or_init(|| WebViewerData::load(None).ok()).as_ref()?;
    Some(
        routes
            .route("/re_viewer.js", file(kind::SCRIPT, files.viewer_js()))
            .route("/re_viewer_bg.wasm", file(kind::WASM, files.viewer_wasm())),
    )
}

/// This build lacks the files of the viewer.
#[cfg(not(feature = "viewer"))]
pub fn with_viewer<S: Clone + Send + Sync + 'static>(_: Router<S>) -> Option<Router<S>> {
    None
}
