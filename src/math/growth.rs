//! Growth of long lists.

/// The inverse of the share of its length that a list gets to spare when it grows: with half of this, twice as much is
/// left unused; with twice of this, growing lists are copied twice as often.
const SPARE: usize = 8;

/// Makes room for `len` items in a list. Lists as long as a mesh take most of the memory: they get an eighth to spare
/// where [`Vec`] doubles.
pub fn make_room<T>(list: &mut Vec<T>, len: usize) {
    if len > list.capacity() {
        list.reserve_exact(len + len / SPARE - list.len());
    }
}

/// Sets the length of a list as [`resize`] does, but makes room for `room` items at once if there is too little. Never
/// inlined, as its callers resize many lists each.
#[inline(never)]
pub fn resize_within<T: Clone>(list: &mut Vec<T>, len: usize, value: T, room: usize) {
    if len > list.capacity() {
        list.reserve_exact(room.max(len) - list.len());
    }
    list.resize(len, value);
}

/// Sets the length of a list as [`Vec::resize`] does, after [`make_room`]. Never inlined, as [`resize_within`].
#[inline(never)]
pub fn resize<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    make_room(list, len);
    list.resize(len, value);
}
