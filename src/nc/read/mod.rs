//! Text to blocks.
//!
//! | step | file |
//! |---|---|
//! | bytes to lines | `lines` |
//! | a line to words and comments | `words` |
//! | what the codes of a block do | `g_codes` |
//! | the other words of a block, each used once | `block_words` |
//! | what holds from block to block; motions | `modal_state` |
//! | NURBS curves, block by block, in each dialect | `curve_blocks`, `curve` |
//! | where the tool is before the program | `initial_position` |
//! | the stream of blocks | `reader` |

mod block_words;
mod curve;
mod curve_blocks;
mod error;
mod g_codes;
mod initial_position;
mod lines;
mod modal_state;
mod reader;
mod reading;
mod words;

pub use error::{NcError, SyntaxError};
pub(super) use g_codes::Codes;
pub use lines::MAX_LINE_BYTES;
pub use reader::Reader;
pub use reading::Reading;
pub(super) use words::Words;
