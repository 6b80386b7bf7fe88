//! The files that the viewer in a browser consists of; they are inside the binary.

use std::sync::OnceLock;

use re_web_viewer_server::WebViewerData;

/// One of the viewer's files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewerFile {
    /// JavaScript that loads the program and speaks to it.
    Script,
    /// The program, WebAssembly.
    Program,
}

/// A file of the viewer; `None` if this build has none.
pub fn viewer_file(file: ViewerFile) -> Option<&'static [u8]> {
    static FILES: OnceLock<Option<WebViewerData>> = OnceLock::new();
    let files = FILES.get_or_init(|| WebViewerData::load(None).ok()).as_ref()?;
    Some(match file {
        ViewerFile::Script => files.viewer_js(),
        ViewerFile::Program => files.viewer_wasm(),
    })
}
