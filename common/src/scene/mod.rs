//! The photographed object: its shape, the camera, and where both lie in the photo.
