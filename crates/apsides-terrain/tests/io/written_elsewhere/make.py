"""Small GeoTIFFs of GDAL and of tifffile: compressions and predictors, each with the heights of one formula.

Run: python make.py FOLDER, with rasterio (its GDAL) and tifffile with imagecodecs. Heights: see `height` in tests/io/written_elsewhere.rs.
"""
import sys
import numpy as np
import rasterio
import tifffile
from rasterio.crs import CRS
from rasterio.transform import from_origin

folder = sys.argv[1]
ROWS, COLS = 37, 41


def heights(dtype):
    r, c = np.mgrid[0:ROWS, 0:COLS]
    z = -1500.0 + 3.0 * r - 2.0 * c + ((r * 37 + c * 11) % 17) * 0.25
    return np.round(z).astype(dtype) if np.issubdtype(dtype, np.integer) else z.astype(dtype)


def gdal(name, dtype, gap=False, **options):
    z = heights(np.dtype(dtype))
    if gap:
        z[5:8, 30:36] = np.nan
    moon = CRS.from_proj4("+proj=eqc +lat_ts=0 +lon_0=0 +a=1737400 +b=1737400 +units=m +no_defs")
    profile = dict(driver="GTiff", height=ROWS, width=COLS, count=1, dtype=dtype, crs=moon,
                   transform=from_origin(1000.0, 2000.0, 2.0, 2.0))
    profile.update(options)
    with rasterio.open(f"{folder}/{name}.tif", "w", **profile) as file:
        file.write(z, 1)


TILES = dict(tiled=True, blockxsize=16, blockysize=16)
gdal("gdal_zstd", "float32", compress="zstd", **TILES)
gdal("gdal_zstd_p2", "float32", compress="zstd", predictor=2, **TILES)
gdal("gdal_zstd_p3", "float32", compress="zstd", predictor=3, blockysize=7)
gdal("gdal_zstd_p2_i16", "int16", compress="zstd", predictor=2, blockysize=7)
gdal("gdal_deflate_p2", "float32", compress="deflate", predictor=2, blockysize=7)
gdal("gdal_deflate_p2_f64_be", "float64", compress="deflate", predictor=2, ENDIANNESS="BIG", **TILES)
gdal("gdal_deflate_p3", "float32", compress="deflate", predictor=3, **TILES)
gdal("gdal_deflate_p3_f64_be", "float64", compress="deflate", predictor=3, ENDIANNESS="BIG", blockysize=7)
gdal("gdal_lzw_p2", "float32", compress="lzw", predictor=2, **TILES)
gdal("gdal_lzw_p3", "float32", compress="lzw", predictor=3, blockysize=7)
gdal("gdal_lerc", "float32", compress="lerc", MAX_Z_ERROR=0, **TILES)
gdal("gdal_lerc_gaps", "float32", gap=True, compress="lerc", MAX_Z_ERROR=0, **TILES)
gdal("gdal_lerc_lossy", "float32", compress="lerc", MAX_Z_ERROR=0.04, blockysize=7)
gdal("gdal_lerc_deflate", "float64", compress="lerc_deflate", MAX_Z_ERROR=0, **TILES)
gdal("gdal_lerc_zstd", "float32", gap=True, compress="lerc_zstd", MAX_Z_ERROR=0, blockysize=7)
gdal("gdal_lerc_i16_be", "int16", compress="lerc", MAX_Z_ERROR=0, ENDIANNESS="BIG", **TILES)
gdal("gdal_lzma", "float32", compress="lzma", **TILES)

# The Moon in degrees, 1/512 deg a pixel around 26 N, 3.6 W, heights of the same formula.
degrees = CRS.from_proj4("+proj=longlat +a=1737400 +b=1737400 +no_defs")
with rasterio.open(f"{folder}/gdal_degrees_moon.tif", "w", driver="GTiff", height=ROWS, width=COLS, count=1,
                   dtype="float32", crs=degrees, transform=from_origin(-3.6, 26.0, 1 / 512, 1 / 512),
                   compress="deflate", predictor=3) as file:
    file.write(heights(np.dtype("float32")), 1)
with rasterio.open(f"{folder}/gdal_degrees_wgs84.tif", "w", driver="GTiff", height=ROWS, width=COLS, count=1,
                   dtype="float32", crs=CRS.from_epsg(4326), transform=from_origin(-3.6, 26.0, 1 / 512, 1 / 512),
                   compress="deflate") as file:
    file.write(heights(np.dtype("float32")), 1)


def other(name, dtype, **options):
    scale = [(33550, "d", 3, (2.0, 2.0, 0.0), True), (33922, "d", 6, (0.0, 0.0, 0.0, 1000.0, 2000.0, 0.0), True)]
    tifffile.imwrite(f"{folder}/{name}.tif", heights(np.dtype(dtype)), photometric="minisblack",
                     extratags=scale, metadata=None, **options)


other("tifffile_zstd_p3", "float32", compression="zstd", predictor=3, tile=(16, 16))
other("tifffile_lerc", "float32", compression="lerc", tile=(16, 16))

# In degrees without a reference system, so that no radius is stated.
tifffile.imwrite(f"{folder}/tifffile_degrees.tif", heights(np.dtype("float32")), photometric="minisblack", metadata=None,
                 extratags=[(33550, "d", 3, (1 / 512, 1 / 512, 0.0), True),
                            (33922, "d", 6, (0.0, 0.0, 0.0, -3.6, 26.0, 0.0), True),
                            (34735, "H", 12, (1, 1, 0, 2, 1024, 0, 1, 2, 1025, 0, 1, 1), True)])
