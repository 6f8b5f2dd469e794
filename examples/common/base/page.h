/* page.h - a page of HTML: headings, texts, tables, pictures that lie beside it. No JavaScript; text is escaped. */
#ifndef EXAMPLES_BASE_PAGE_H
#define EXAMPLES_BASE_PAGE_H

#include <stdbool.h>
#include <stdio.h>

struct page {
    FILE *file;
};

/* False if the file cannot be made. page_close: was everything written? */
bool page_open(struct page *page, const char *path, const char *title);
bool page_close(struct page *page);

void page_heading(struct page *page, int level, const char *text);
void page_text(struct page *page, const char *text);
void page_code(struct page *page, const char *text);
void page_failure(struct page *page, const char *text); /* stands out */

/* The first row names the columns. */
void page_table_begin(struct page *page);
void page_row(struct page *page, bool is_head, const char *const *cells, int count);
void page_table_end(struct page *page);

/* `source`: the PNG's path from the page. */
void page_picture(struct page *page, const char *source, const char *caption);

/* As text of an element or of a quoted attribute; control characters become '?'. */
void page_escape(FILE *file, const char *text);

#endif
