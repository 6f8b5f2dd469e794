"""table.py - the last step of a cohort: table.csv with a line for each scan and each image of a series but its first, times.csv with what
they took, and contact sheets. The table has nothing in it that differs from run to run."""
import csv
import glob
import json
import os

import nibabel
import numpy as np
from PIL import Image, ImageDraw

WIDTH, CAPTION, BORDER, COLUMNS = 480, 18, 4, 4
COLORS = {'trusted': 'white', 'not trusted': 'orange', 'failed': 'red'}


def read(path):
    with open(path) as file:
        return json.load(file)


def carried_volume(path):
    """Returns the volume of a label map in ml, None where there is none."""
    if not os.path.exists(path):
        return None
    labels = nibabel.load(path)
    return np.count_nonzero(np.asarray(labels.dataobj)) * abs(np.linalg.det(labels.affine[:3, :3])) / 1000


def measured(kind, folder):
    """Returns volume, confidence, its error and warnings of what is there in full, and its picture's name."""
    report = read(os.path.join(folder, 'report.json'))
    warnings = [report.get(key) for key in ('image_warning', 'fixed_warning', 'moving_warning')]
    if kind == 'scan':
        confidence = report.get('confidence') or {}
        return (*(confidence.get(key) for key in ('volume_ml', 'predicted_dice', 'predicted_dice_error')), warnings, 'slices.png')
    volume = carried_volume(os.path.join(folder, 'inverse_labels.nii.gz'))
    return volume, report.get('correlation_after'), None, warnings, 'before_after.png'


def entry(kind, path):
    """Returns what the table and the sheets have of one step. What failed may have left a part of its files, of which nothing is read."""
    folder, step = os.path.dirname(path), read(path)
    volume, trust, deviation, warnings, picture = (None, None, None, [], None) if step['result'] == 'failed' else measured(kind, folder)
    return {'kind': kind, 'name': '/'.join(folder.split('/')[-1 if kind == 'scan' else -2:]), 'result': step['result'],
            'volume_ml': number(volume), 'confidence': number(trust), 'confidence_error': number(deviation),
            'warnings': '; '.join(w for w in (step['reason'], *warnings) if w), 'step': step,
            'picture': picture and os.path.join(folder, picture)}


def number(value):
    return '' if value is None else f'{value:.3f}'


def write_csv(path, columns, rows):
    with open(path, 'w', newline='') as file:
        table = csv.writer(file, lineterminator='\n')
        table.writerow(columns)
        table.writerows(rows)


def small_picture(item):
    """Returns a step's picture as wide as a tile is, None where there is none."""
    if not item['picture'] or not os.path.exists(item['picture']):
        return None
    with Image.open(item['picture']) as picture:
        size = WIDTH - 2 * BORDER
        return picture.convert('RGB').resize((size, size * picture.height // picture.width), Image.LANCZOS)


def draw_tile(sheet, item, picture, x, y, height):
    draw = ImageDraw.Draw(sheet)
    color = COLORS[item['result']]
    draw.rectangle([x, y, x + WIDTH - 1, y + height - 1], outline=color, width=1 if color == 'white' else BORDER)
    text = item['name'] + ('' if item['result'] == 'trusted' else f': {item["result"]}')
    draw.text((x + 8, y + 6), text.encode('latin-1', 'replace').decode('latin-1'), fill=color)
    if picture:
        sheet.paste(picture, (x + BORDER, y + CAPTION + BORDER))


def draw_sheets(folder, name, items, per_sheet):
    for old in glob.glob(os.path.join(glob.escape(folder), f'{name}_[0-9][0-9][0-9]*.png')):
        os.remove(old)   # an earlier run may have had more
    for first in range(0, len(items), per_sheet):
        shown = [(item, small_picture(item)) for item in items[first:first + per_sheet]]
        columns = min(COLUMNS, len(shown))
        height = max(picture.height if picture else 0 for _, picture in shown) + CAPTION + 2 * BORDER
        sheet = Image.new('RGB', (columns * WIDTH, -(-len(shown) // columns) * height), '#202020')
        for k, (item, picture) in enumerate(shown):
            draw_tile(sheet, item, picture, k % columns * WIDTH, k // columns * height, height)
        sheet.save(os.path.join(folder, f'{name}_{first // per_sheet + 1:03d}.png'))


def main(scans, frames, table, per_sheet):
    scans, frames = [entry('scan', path) for path in scans], [entry('frame', path) for path in frames]
    items, folder = scans + frames, os.path.dirname(table)
    draw_sheets(folder, 'scans', scans, per_sheet)
    draw_sheets(folder, 'frames', frames, per_sheet)
    used = ('attempt', 'seconds', 'processor_seconds', 'mib')
    write_csv(os.path.join(folder, 'times.csv'), ('kind', 'name', *used),
              ((item['kind'], item['name'], *(f'{item["step"][key]:.4g}' for key in used)) for item in items))
    columns = ('kind', 'name', 'result', 'volume_ml', 'confidence', 'confidence_error', 'warnings')
    write_csv(table, columns, ([item[column] for column in columns] for item in items))
    for item in items:
        if item['result'] != 'trusted':
            print(f'{item["name"]}: {item["result"]}: {item["warnings"]}')
    print(', '.join(f'{sum(item["result"] == result for item in items)} {result}' for result in COLORS))


main(snakemake.input.scans, snakemake.input.frames, snakemake.output[0], snakemake.params.per_sheet)
