use super::*;

#[test]
fn frames_in_flight_have_contents_of_their_own_and_memory_is_used_again() {
    let buffer = GeneratedBuffer::<[f32; 3]>::with_chunk("points", 10, 4);
    assert_eq!((buffer.chunk_count(), buffer.chunk_range(2)), (3, 8..10));
    let fill = |contents: &GeneratedContents, value: f32| {
        for chunk in 0..3 {
            contents.fill::<[f32; 3]>(chunk).unwrap().fill([value; 3]);
        }
    };
    let first = buffer.source().begin_frame().unwrap();
    assert_eq!(first.unfilled_chunk(), Some(0));
    fill(&first, 1.0);
    let second = buffer.source().begin_frame().unwrap();
    fill(&second, 2.0);
    assert_eq!(first.elements::<[f32; 3]>(), [[1.0; 3]; 10]);
    assert_eq!(first.unfilled_chunk(), None);
    assert_eq!(first.fill::<[f32; 3]>(3).err(), Some(ChunkError::Unknown));
    let memory = |contents: &GeneratedContents| std::ptr::from_ref(contents);
    let before = memory(&first);
    drop(first);
    let third = buffer.source().begin_frame().unwrap();
    assert_eq!((memory(&third), third.unfilled_chunk()), (before, Some(0)));
    assert_eq!(second.elements::<[f32; 3]>(), [[2.0; 3]; 10]);
}

#[test]
fn only_elements_that_count_are_there() {
    let buffer = GeneratedBuffer::<u32>::with_chunk("numbers", 10, 4);
    let contents = buffer.source().begin_frame().unwrap();
    contents.fill::<u32>(0).unwrap().fill(7);
    contents.set_count(3);
    assert_eq!((contents.unfilled_chunk(), contents.elements::<u32>()), (None, vec![7; 3]));
    contents.set_count(5);
    assert_eq!(contents.unfilled_chunk(), Some(1));
    contents.set_count(11);
    assert_eq!(contents.count(), 10);
    contents.set_count(0);
    assert_eq!((contents.unfilled_chunk(), contents.elements::<u32>()), (None, vec![]));
}

#[test]
fn indices_beyond_whole_triangles_repeat_the_last_one() {
    let buffer = GeneratedBuffer::<u32>::with_chunk("indices", 10, 4);
    let contents = buffer.source().begin_frame().unwrap();
    for chunk in 0..3 {
        let indices = buffer.chunk_range(chunk);
        contents
            .fill::<u32>(chunk)
            .unwrap()
            .iter_mut()
            .zip(indices)
            .for_each(|(index, value)| *index = 100 + value as u32);
    }
    for (count, list, strip) in [
        (0, (0, 0), (0, 0)),
        (2, (0, 0), (0, 0)),
        (3, (3, 102), (3, 102)),
        (5, (3, 102), (5, 104)),
        (10, (9, 108), (10, 109)),
    ] {
        contents.set_count(count);
        assert_eq!(contents.whole_triangles(Topology::TriangleList), list, "{count}");
        assert_eq!(contents.whole_triangles(Topology::TriangleStrip), strip, "{count}");
    }
}

#[test]
fn what_nobody_has_filled_is_not_read_and_a_leaked_chunk_costs_one_frame() {
    let buffer = GeneratedBuffer::<u32>::with_chunk("numbers", 8, 4);
    let contents = buffer.source().begin_frame().unwrap();
    assert_eq!(contents.read::<u32>(0).err(), Some(ChunkError::Unfilled));
    std::mem::forget(contents.fill::<u32>(0).unwrap());
    contents.fill::<u32>(1).unwrap().fill(1);
    assert_eq!((contents.unfilled_chunk(), contents.fill::<u32>(0).err()), (Some(0), Some(ChunkError::Held)));
    drop(contents);
    let contents = buffer.source().begin_frame().unwrap();
    contents.fill::<u32>(0).unwrap().fill(2);
    assert_eq!(contents.read::<u32>(0).unwrap()[3], 2);
}

#[test]
fn sizes_that_overflow_have_no_contents_and_chunks_that_are_not_there_no_elements() {
    for capacity in [usize::MAX, 1 << 62, 1 << 60, isize::MAX as usize / 16 + 1] {
        for chunk in [1, 1 << 10, 1 << 62, usize::MAX] {
            let buffer = GeneratedBuffer::<[u32; 4]>::with_chunk("huge", capacity, chunk);
            let count = buffer.chunk_count();
            assert_eq!(buffer.chunk_range(count - 1).end, capacity, "{chunk}");
            assert!(buffer.chunk_range(count).is_empty() && buffer.chunk_range(usize::MAX).is_empty());
            assert!(buffer.source().begin_frame().is_none(), "{capacity} {chunk}");
        }
    }
    let buffer = GeneratedBuffer::<u32>::with_chunk("small", 8, usize::MAX);
    let contents = buffer.source().begin_frame().unwrap();
    contents.fill::<u32>(0).unwrap().fill(3);
    assert_eq!(contents.elements::<u32>(), [3; 8]);
    assert_eq!(contents.fill::<u32>(usize::MAX).err(), Some(ChunkError::Unknown));
}

#[test]
fn the_contents_of_many_frames_at_once_are_dropped_again() {
    let buffer = GeneratedBuffer::<u32>::new("numbers", 8);
    let all: Vec<_> = (0..50).map(|_| buffer.source().begin_frame().unwrap()).collect();
    drop(all);
    drop(buffer.source().begin_frame().unwrap());
    assert_eq!(buffer.source().contents.lock().len(), MAX_FREE_CONTENTS);
}
