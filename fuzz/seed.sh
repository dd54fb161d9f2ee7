#!/bin/sh
# Fills corpus/ with seed files.
set -eu
cd "$(dirname "$0")"
mkdir -p corpus/exr corpus/hdr corpus/pfm corpus/png_jpeg corpus/tiff corpus/codec corpus/journal corpus/manifest
cp ../common/src/image/fixtures/*.exr corpus/exr/
printf '#?RADIANCE\nEXPOSURE=2\nCOLORCORR=1 1 2\nPRIMARIES=0.64 0.33 0.29 0.60 0.15 0.06 0.333 0.333\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 10\n\002\002\000\012\212\200\212\000\212\000\212\201' > corpus/hdr/new
printf '#?RGBE\n\n+X 1 -Y 4\n\200\100\040\201\001\001\001\003' > corpus/hdr/old
printf 'PF\n1 1\n-1.0\n\000\000\200\077\000\000\200\077\000\000\200\077' > corpus/pfm/colour
printf 'Pf\r\n1 2\r\n2\r\n\077\200\000\000\077\200\000\000' > corpus/pfm/grey
# One pixel of half floats.
printf 'II*\000\010\000\000\000\011\000\000\001\003\000\001\000\000\000\001\000\000\000\001\001\003\000\001\000\000\000\001\000\000\000\002\001\003\000\003\000\000\000\200\000\000\000\003\001\003\000\001\000\000\000\001\000\000\000\006\001\003\000\001\000\000\000\002\000\000\000\021\001\004\000\001\000\000\000\172\000\000\000\025\001\003\000\001\000\000\000\003\000\000\000\027\001\004\000\001\000\000\000\006\000\000\000\123\001\003\000\003\000\000\000\206\000\000\000\000\000\000\000\000\074\000\074\000\074\020\000\020\000\020\000\003\000\003\000\003\000' > corpus/tiff/half
cp seeds/png_jpeg/* corpus/png_jpeg/
# The first byte selects the reader: a frame with a goodbye message, an access file.
printf '\001\003\002\000\000\000\000\006' > corpus/codec/frame
printf '\006{ "address": "127.0.0.1:45123", "certificate": "blake3:%064d", "secret": "%064d" }' 0 0 > corpus/codec/access
# Third table, fourth column, an integer: a node state that does not exist.
printf '\002\003\001\000\377\000\000\000\000\000\000\000' > corpus/journal/state
printf '\006\004\004\001abcdefgh' > corpus/journal/output
printf 'photos = ["*.exr"]\nenvironments = "sky.hdr"\nmodels = ["ggx"]\n[defaults]\nsamples = 32\n[[set]]\nname = "a"\nphotos = "gold.exr"\nenvironments = "sky.hdr"\nenv-rotation = 90\n[[fit]]\nname = "b"\nphoto = "tin.exr"\nenv = "sky.hdr"\nsphere = [1, 2, 3]\nmax-cssim = 0.05\n' > corpus/manifest/all
