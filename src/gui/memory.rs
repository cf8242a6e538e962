//! Memory that the frames of the window share.

/// Memory that a frame frees and the next one takes again, bytes: triangles of full plots.
const FRAME_BYTES: usize = 8 << 20;

/// Has the allocator keep what a frame frees. The one of glibc hands the end of its heap back to the system and takes it
/// anew, page by page, which can be most of what a frame costs; a larger block that was freed once teaches it to wait
/// for twice its size.
pub fn keep_freed_memory() {
    drop(std::hint::black_box(Vec::<u8>::with_capacity(FRAME_BYTES)));
}
