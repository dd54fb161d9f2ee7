"""Makes seeds/png_jpeg: small whole files to mutate. Provenance: Pillow and numpy from PyPI; run in this folder."""
import numpy as np
from PIL import Image, ImageCms, PngImagePlugin

y, x = np.mgrid[0:12, 0:16]
rgb = Image.fromarray(np.stack([x * 16, y * 20, x * y], -1).astype(np.uint8))
text = PngImagePlugin.PngInfo()
text.add_text("Software", "seed")
text.add_itxt("note", "\u2264")
srgb = ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
exif = Image.Exif()
exif[0x0112] = 6
rgb.save("png_jpeg/rgb.png", pnginfo=text)
rgb.convert("RGBA").save("png_jpeg/rgba.png", exif=exif, icc_profile=srgb)
rgb.quantize(8).save("png_jpeg/palette.png", bits=4, transparency=1)
Image.fromarray((x * 4000).astype(np.uint16)).save("png_jpeg/grey16.png")
rgb.convert("1").save("png_jpeg/bits.png")
rgb.save("png_jpeg/baseline.jpg", exif=exif)
rgb.save("png_jpeg/progressive.jpg", progressive=True, subsampling=0)
rgb.convert("L").save("png_jpeg/grey.jpg", restart_marker_blocks=1)
rgb.convert("CMYK").save("png_jpeg/cmyk.jpg")
