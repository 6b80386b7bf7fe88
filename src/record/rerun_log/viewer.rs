//! This module gives access to the files of the browser viewer, which are part of the binary.

use std::sync::OnceLock;

use re_web_viewer_server::WebViewerData;

/// A file of the browser viewer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewerFile {
    /// JavaScript that loads the program and communicates with it.
    Script,
    /// The program, in WebAssembly.
    Program,
}

/// Content of a file of the viewer; `None` if this build does not contain the viewer.
pub fn viewer_file(file: ViewerFile) -> Option<&'static [u8]> {
    static FILES: OnceLock<Option<WebViewerData>> = OnceLock::new();
    let files = FILES.get_or_init(|| WebViewerData::load(None).ok()).as_ref()?;
    Some(match file {
        ViewerFile::Script => files.viewer_js(),
        ViewerFile::Program => files.viewer_wasm(),
    })
}
